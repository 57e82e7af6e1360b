#include "render_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "errors.h"
#include "io/history.h"
#include "io/provenance.h"
#include "plot.h"

namespace anticrack {

namespace {

namespace fs = std::filesystem;

/// A column as asked for: maybe its negative.
struct ColumnRequest {
  std::string name;
  bool negative = false;
  double HistoryRow::*member = nullptr;
};

ColumnRequest find_column(std::string text) {
  ColumnRequest request;
  request.negative = text.starts_with('-');
  request.name = request.negative ? text.substr(1) : text;
  std::vector<std::string> names;
  for (const HistoryColumn& column : history_columns) {
    if (column.name == request.name) request.member = column.value;
    names.emplace_back(column.name);
  }
  if (request.member == nullptr) {
    throw InputError(fmt::format("column \"{}\" is not in history.csv; expected one of {}.", text,
                                 fmt::join(names, ", ")));
  }
  return request;
}

bool is_stress(const std::string& name) {
  return name == "p" || name == "q" || name == "q_of_mean" || name == "p_paper" || name == "q_paper" ||
         name.starts_with("sigma_");
}

std::string symbol(const ColumnRequest& column) {
  const std::string sign = column.negative ? "\u2212" : "";
  if (column.name.starts_with("strain_")) return fmt::format("{}\u03b5_{}", sign, column.name.back());
  if (column.name.starts_with("sigma_")) return fmt::format("{}\u03c3_{{{}}}", sign, column.name.substr(6));
  if (column.name == "q_of_mean") return sign + "q of mean stress";
  if (column.name == "p_paper") return sign + "p, solid average";
  if (column.name == "q_paper") return sign + "q, solid average";
  std::string words = column.name;
  std::replace(words.begin(), words.end(), '_', ' ');
  return sign + words;
}

struct Unit {
  std::string name;
  double size = 1;
};

/// The unit in which the largest of the values reads well.
Unit unit_of(const std::string& column, double largest) {
  if (column.starts_with("strain_")) return {"%", 0.01};
  if (is_stress(column)) {
    if (largest >= 1e9) return {"GPa", 1e9};
    if (largest >= 1e4) return {"MPa", 1e6};
    return largest >= 10 ? Unit{"kPa", 1e3} : Unit{"Pa", 1};
  }
  if (column.starts_with("wall_force_")) return {"N", 1};
  if (column.ends_with("_energy") || column == "plastic_dissipation" || column == "numerical_dissipation" ||
      column == "wall_work") {
    return {"J", 1};
  }
  if (column == "time" || column == "dt" || column == "wall_seconds") return {"s", 1};
  return {};
}

std::string with_unit(const std::string& text, const Unit& unit) {
  return unit.name.empty() ? text : fmt::format("{} [{}]", text, unit.name);
}

std::string largest_strain(const std::vector<HistoryRow>& rows) {
  std::string best = "strain_y";
  double largest = 0;
  for (const auto& [name, member] : {std::pair{"strain_y", &HistoryRow::strain_y},
                                     {"strain_x", &HistoryRow::strain_x},
                                     {"strain_z", &HistoryRow::strain_z}}) {
    if (!rows.empty() && std::abs(rows.back().*member) > largest) {
      largest = std::abs(rows.back().*member);
      best = name;
    }
  }
  return best;
}

}  // namespace

std::string plot_histories(const std::vector<std::string>& runs, std::string x, std::string y,
                           const fs::path& output, int width, int height) {
  // Refuse wrong columns and formats before any file is read.
  const DocumentFormat format = document_format(output.string());
  std::vector<ColumnRequest> y_columns;
  if (y.empty()) y = "p,q";
  for (std::size_t from = 0; from <= y.size();) {
    const std::size_t end = std::min(y.find(',', from), y.size());
    y_columns.push_back(find_column(y.substr(from, end - from)));
    from = end + 1;
  }
  if (!x.empty()) find_column(x);

  std::vector<std::vector<HistoryRow>> histories;
  std::vector<std::string> names;
  for (const std::string& run : runs) {
    const fs::path file = fs::path(run) / "history.csv";
    if (!fs::is_regular_file(file)) {
      throw InputError(fmt::format("{}: not a run folder: it holds no history.csv.", run));
    }
    histories.push_back(read_history(file));
    names.push_back(fs::absolute(fs::path(run) / "").parent_path().filename().string());
  }
  const ColumnRequest x_column = find_column(x.empty() ? "-" + largest_strain(histories.front()) : x);

  double largest = 0;
  for (const auto& rows : histories) {
    for (const HistoryRow& row : rows) {
      for (const ColumnRequest& column : y_columns) {
        const double v = std::abs(row.*column.member);
        if (std::isfinite(v)) largest = std::max(largest, v);
      }
    }
  }
  const Unit x_unit = unit_of(x_column.name, 0);
  const Unit y_unit = unit_of(y_columns.front().name, largest);
  for (const ColumnRequest& column : y_columns) {
    if (unit_of(column.name, largest).name != y_unit.name) {
      throw InputError(fmt::format("--y {}: {} and {} have different units; plot them apart.", y,
                                   y_columns.front().name, column.name));
    }
  }

  Plot plot;
  plot.x_label = with_unit(symbol(x_column), x_unit);
  const bool one = y_columns.size() == 1;
  plot.y_label = with_unit(one                                 ? symbol(y_columns.front())
                           : is_stress(y_columns.front().name) ? "stress"
                                                               : "",
                           y_unit);
  for (std::size_t run = 0; run < histories.size(); ++run) {
    for (const ColumnRequest& column : y_columns) {
      Curve curve;
      const std::string name = plain_text(names[run]);
      curve.label = histories.size() == 1 ? (one ? "" : symbol(column))
                    : one                 ? name
                                          : fmt::format("{}: {}", name, symbol(column));
      for (const HistoryRow& row : histories[run]) {
        curve.x.push_back((x_column.negative ? -1 : 1) * row.*x_column.member / x_unit.size);
        curve.y.push_back((column.negative ? -1 : 1) * row.*column.member / y_unit.size);
      }
      plot.curves.push_back(std::move(curve));
    }
  }
  return draw_plot(plot, format, width, height,
                   {{"Software", fmt::format("anticrack {}", program_version())},
                    {"Parameters", fmt::format("--plot --x={} --y={}",
                                               (x_column.negative ? "-" : "") + x_column.name, y)}});
}

}  // namespace anticrack
