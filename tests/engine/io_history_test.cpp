#include "io/history.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "io_test_folder.h"

namespace anticrack {
namespace {

class History : public IoTest {
 protected:
  std::filesystem::path file = folder / "history.csv";
};

// Every column another value, of every size a double can have.
HistoryRow row_of_step(int step) {
  HistoryRow row;
  double value = 1.0 / 3 + step;
  for (const HistoryColumn& column : history_columns) row.*column.value = value *= -7.3e-9 * (1 + step);
  row.step = step;
  row.second_order_work = std::numeric_limits<double>::denorm_min();
  row.elastic_energy = std::numeric_limits<double>::max();
  row.wall_work = -0.0;
  return row;
}

void expect_same_bits(const HistoryRow& a, const HistoryRow& b) {
  for (const HistoryColumn& column : history_columns)
    EXPECT_EQ(std::bit_cast<std::uint64_t>(a.*column.value), std::bit_cast<std::uint64_t>(b.*column.value))
        << column.name;
}

TEST_F(History, ColumnsAreThePublishedOnes) {
  { HistoryWriter writer(file); }
  EXPECT_EQ(
      file_content(file),
      "step,time,dt,strain_x,strain_y,strain_z,p,q,q_of_mean,p_paper,q_paper,sigma_xx,sigma_yy,sigma_zz,"
      "sigma_xy,sigma_xz,sigma_yz,wall_force_x0,wall_force_x1,wall_force_y0,wall_force_y1,wall_force_z0,"
      "wall_force_z1,second_order_work,kinetic_energy,elastic_energy,plastic_dissipation,"
      "numerical_dissipation,wall_work,energy_residual,solid_fraction,plastic_fraction,strays,active_leaves,"
      "wall_seconds\n");
}

TEST_F(History, ReadsBackTheSameDoubles) {
  HistoryWriter writer(file);
  for (int step = 0; step < 5; ++step) writer.append(row_of_step(step));
  const auto rows = read_history(file);
  ASSERT_EQ(rows.size(), 5u);
  for (int step = 0; step < 5; ++step) expect_same_bits(rows[step], row_of_step(step));
}

TEST_F(History, ReadsBackWhatIsNotFinite) {
  HistoryRow row;
  row.p = std::numeric_limits<double>::quiet_NaN();
  row.q = -std::numeric_limits<double>::infinity();
  HistoryWriter writer(file);
  writer.append(row);
  const auto rows = read_history(file);
  EXPECT_TRUE(std::isnan(rows.at(0).p));
  EXPECT_EQ(rows.at(0).q, row.q);
}

TEST_F(History, WholeNumbersAreWrittenAsSuch) {
  HistoryRow row;
  row.step = 100000;
  HistoryWriter writer(file);
  writer.append(row);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "\n100000,0,", file_content(file));
}

TEST_F(History, EachRowIsInTheFileAtOnce) {
  HistoryWriter writer(file);
  writer.append(row_of_step(1));
  EXPECT_EQ(read_history(file).size(), 1u);
  writer.append(row_of_step(2));
  EXPECT_EQ(read_history(file).size(), 2u);
}

TEST_F(History, ContinuingDropsLaterAndTornRowsAndKeepsTheBytesOfTheOthers) {
  {
    HistoryWriter writer(file);
    for (int step = 0; step <= 40; step += 20) writer.append(row_of_step(step));
  }
  const std::string whole = file_content(file);
  put_file(file, whole + "60,0.1,0.0");
  {
    HistoryWriter writer(file, 20);
    writer.append(row_of_step(40));
  }
  EXPECT_EQ(file_content(file), whole);
}

TEST_F(History, StartingAnewReplacesTheOldFile) {
  HistoryWriter(file).append(row_of_step(1));
  HistoryWriter(file).append(row_of_step(2));
  ASSERT_EQ(read_history(file).size(), 1u);
  EXPECT_EQ(read_history(file)[0].step, 2);
}

TEST_F(History, TornLastRowIsOverlooked) {
  HistoryWriter(file).append(row_of_step(1));
  const std::string whole = file_content(file);
  // Cut at every place within the row: none of them may turn up as a row.
  for (std::size_t size = whole.find('\n') + 1; size < whole.size(); ++size) {
    put_file(file, whole.substr(0, size));
    EXPECT_EQ(read_history(file).size(), 0u) << size;
  }
}

TEST_F(History, FaultyRowIsAnErrorWithLineAndColumn) {
  HistoryWriter(file).append(row_of_step(1));
  std::string text = file_content(file);
  put_file(file, text + "2,0.1,fast,0\n");
  std::string message = file_error_of([&] { read_history(file); });
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "history.csv:3: column dt", message);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "fast", message);

  put_file(file, text + "2,0.1,0\n");
  message = file_error_of([&] { read_history(file); });
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "history.csv:3: column dt", message);

  text.insert(text.size() - 1, ",7");
  put_file(file, text);
  message = file_error_of([&] { read_history(file); });
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "history.csv:2: column wall_seconds", message);
}

TEST_F(History, OtherFilesAreRefused) {
  put_file(file, "strain,stress\n1,2\n");
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "history.csv:1: not the header",
                      file_error_of([&] { read_history(file); }));
  put_file(file, "");
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "history.csv:1: not the header",
                      file_error_of([&] { read_history(file); }));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "No such file",
                      file_error_of([&] { read_history(folder / "none.csv"); }));
}

TEST_F(History, FullDiskIsAnErrorAndLeavesWholeRowsReadable) {
  HistoryWriter writer(file);
  writer.append(row_of_step(1));
  std::string message;
  {
    const FullDisk full(file_content(file).size() + 10);
    message = file_error_of([&] { writer.append(row_of_step(2)); });
  }
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "File too large", message);
  ASSERT_EQ(read_history(file).size(), 1u);
  expect_same_bits(read_history(file)[0], row_of_step(1));
}

}  // namespace
}  // namespace anticrack
