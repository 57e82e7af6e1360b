#include "io/history.h"

#include <cerrno>
#include <charconv>
#include <cmath>
#include <string>

#include "files/atomic_file.h"

namespace anticrack {
namespace {

void append_number(std::string& text, double value) {
  char digits[32];
  // Whole numbers as a reader expects them: 100000, not 1e+05.
  const bool whole = value != 0 && std::abs(value) < 1e15 && value == std::trunc(value);
  const auto end = whole ? std::to_chars(digits, digits + sizeof digits, std::int64_t(value))
                         : std::to_chars(digits, digits + sizeof digits, value);
  text.append(digits, end.ptr);
}

std::string header_line() {
  std::string line;
  for (const HistoryColumn& column : history_columns)
    line.append(line.empty() ? "" : ",").append(column.name);
  return line + '\n';
}

std::string row_line(const HistoryRow& row) {
  std::string line;
  for (const HistoryColumn& column : history_columns) {
    if (!line.empty()) line += ',';
    append_number(line, row.*column.value);
  }
  return line + '\n';
}

FileError line_error(const std::filesystem::path& file, std::size_t line, const std::string& what) {
  return FileError(file.string() + ":" + std::to_string(line) + ": " + what);
}

HistoryRow parse_row(const std::filesystem::path& file, std::size_t line_number, const std::string& line) {
  HistoryRow row;
  const char* at = line.data();
  const char* const end = at + line.size();
  for (const HistoryColumn& column : history_columns) {
    const bool last = &column == &history_columns.back();
    const auto [stop, failed] = std::from_chars(at, end, row.*column.value);
    if (failed != std::errc{} || (last ? stop != end : stop == end || *stop != ','))
      throw line_error(file, line_number,
                       "column " + std::string(column.name) + ": expected a number and then " +
                           (last ? "the end of the line" : "a comma") + ", got \"" +
                           std::string(at, std::min(end, at + 24)) + "\"");
    if (!last) at = stop + 1;
  }
  return row;
}

}  // namespace

HistoryWriter::HistoryWriter(const std::filesystem::path& file) : file_(file) {
  write_text_atomically(file_, header_line());
  open();
}

HistoryWriter::HistoryWriter(const std::filesystem::path& file, std::int64_t keep_up_to_step) : file_(file) {
  std::string kept = header_line();
  for (const HistoryRow& row : read_history(file_)) {
    if (row.step <= double(keep_up_to_step)) kept += row_line(row);
  }
  write_text_atomically(file_, kept);
  open();
}

void HistoryWriter::open() {
  errno = 0;
  stream_.open(file_, std::ios::binary | std::ios::app);
  if (!stream_) throw system_file_error(file_, "cannot be opened for writing", errno);
}

void HistoryWriter::append(const HistoryRow& row) {
  const std::string line = row_line(row);
  errno = 0;
  stream_.write(line.data(), std::streamsize(line.size())).flush();
  if (!stream_) throw system_file_error(file_, "cannot be written", errno);
}

void HistoryWriter::flush_to_disk() {
  anticrack::flush_to_disk(file_);
}

std::vector<HistoryRow> read_history(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw system_file_error(file, "cannot be opened", errno);

  std::string line;
  std::getline(stream, line);
  if (line + '\n' != header_line())
    throw line_error(file, 1,
                     "not the header of a history; expected \"" + header_line().substr(0, 40) +
                         "...\", got \"" + line.substr(0, 40) + "\"");

  std::vector<HistoryRow> rows;
  for (std::size_t number = 2; std::getline(stream, line) && !stream.eof(); ++number)
    rows.push_back(parse_row(file, number, line));
  if (stream.bad()) throw system_file_error(file, "cannot be read", errno);
  return rows;
}

}  // namespace anticrack
