#pragma once

#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace anticrack {

/// A CSV table with a header line and quoted fields, by column name.
class CsvTable {
 public:
  explicit CsvTable(const std::string& file) {
    std::ifstream in(file);
    if (!in) throw std::runtime_error("cannot open " + file);
    std::string line;
    std::getline(in, line);
    const auto names = split(line);
    for (std::size_t i = 0; i < names.size(); ++i) column_[names[i]] = i;
    while (std::getline(in, line))
      if (!line.empty()) rows_.push_back(split(line));
  }
  std::size_t size() const { return rows_.size(); }
  const std::string& text(std::size_t row, const std::string& name) const {
    return rows_.at(row).at(column_.at(name));
  }
  double number(std::size_t row, const std::string& name) const {
    return std::strtod(text(row, name).c_str(), nullptr);
  }

 private:
  static std::vector<std::string> split(const std::string& line) {
    std::vector<std::string> fields(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"')
        quoted = !quoted;
      else if (c == ',' && !quoted)
        fields.emplace_back();
      else if (c != '\r')
        fields.back() += c;
    }
    return fields;
  }
  std::map<std::string, std::size_t> column_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace anticrack
