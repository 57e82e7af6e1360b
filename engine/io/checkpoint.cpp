#include "io/checkpoint.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "errors.h"
#include "files/atomic_file.h"
#include "io/provenance.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

constexpr std::array<char, 8> magic = {'A', 'N', 'T', 'I', 'C', 'R', 'C', 'P'};
constexpr std::uint32_t byte_order_mark = 0x01020304;
constexpr std::uint32_t format_version = 5;
constexpr std::size_t piece = 1 << 20;  // bytes read at once while verifying

// Any format begins with these 40 bytes, so that a reader can tell another format from damage.
struct Head {
  std::array<char, 8> magic;
  std::uint32_t byte_order_mark;
  std::uint32_t format_version;
  std::uint64_t array_count;
  std::uint64_t table_bytes;
  std::uint32_t table_checksum;
  std::uint32_t head_checksum;  // of all members before
};
static_assert(sizeof(Head) == 40 && std::has_unique_object_representations_v<Head>);

std::uint32_t checksum(std::span<const std::byte> bytes, std::uint32_t start = 0) {
  return libdeflate_crc32(start, bytes.data(), bytes.size());
}

std::uint32_t head_checksum(const Head& head) {
  return checksum(std::as_bytes(std::span(&head, 1)).first(offsetof(Head, head_checksum)));
}

template <class T>
void append(std::vector<std::byte>& table, const T& value) {
  const auto bytes = std::as_bytes(std::span(&value, 1));
  table.insert(table.end(), bytes.begin(), bytes.end());
}

// Takes values off the front of a table; the table's checksum held, so running short means a faulty writer.
class TableReader {
 public:
  explicit TableReader(std::span<const std::byte> rest) : rest_(rest) {}

  bool take(std::span<std::byte> into) {
    if (into.size() > rest_.size()) return false;
    std::ranges::copy(rest_.first(into.size()), into.begin());
    rest_ = rest_.subspan(into.size());
    return true;
  }
  template <class T>
  bool take(T& value) {
    return take(std::as_writable_bytes(std::span(&value, 1)));
  }
  std::size_t left() const { return rest_.size(); }

 private:
  std::span<const std::byte> rest_;
};

void write_bytes(std::ofstream& stream, std::span<const std::byte> bytes) {
  stream.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
}

FileError file_error(const fs::path& file, const std::string& what) {
  return FileError(file.string() + ": " + what);
}

FileError array_error(const fs::path& file, std::string_view name, const std::string& what) {
  return file_error(file, "array \"" + std::string(name) + "\": " + what);
}

// Oldest first.
std::vector<fs::path> list_checkpoints(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("checkpoint_") && name.ends_with(".bin")) files.push_back(entry.path());
  }
  if (error == std::errc::no_such_file_or_directory) return {};
  if (error) throw system_file_error(folder, "cannot be listed", error.value());
  std::ranges::sort(files);
  return files;
}

}  // namespace

CheckpointWriter::CheckpointWriter(std::string_view scene_text) {
  add_text("program", program_version());
  add_text("scene", scene_text);
}

void CheckpointWriter::add_text(std::string_view name, std::string_view text) {
  add_copy<std::uint8_t>(name, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

void CheckpointWriter::add_bytes(std::string_view name, char type, std::size_t element_size,
                                 std::span<const std::byte> bytes) {
  if (std::ranges::any_of(arrays_, [name](const Array& array) { return array.name == name; }))
    throw InputError("checkpoint: array \"" + std::string(name) + "\" is there already");
  arrays_.push_back({std::string(name), type, std::uint32_t(element_size), bytes});
}

void CheckpointWriter::write(const fs::path& file) const {
  // Offsets are absolute, so the size of the table comes first.
  std::uint64_t table_bytes = 0;
  for (const Array& array : arrays_) table_bytes += 4 + array.name.size() + 1 + 4 + 8 + 8 + 4;

  std::vector<std::byte> table;
  std::uint64_t offset = sizeof(Head) + table_bytes;
  for (const Array& array : arrays_) {
    append(table, std::uint32_t(array.name.size()));
    for (const char letter : array.name) append(table, letter);
    append(table, array.type);
    append(table, array.element_size);
    append(table, std::uint64_t(array.bytes.size() / array.element_size));
    append(table, offset);
    append(table, checksum(array.bytes));
    offset += array.bytes.size();
  }

  Head head{magic, byte_order_mark, format_version, arrays_.size(), table_bytes, checksum(table), 0};
  head.head_checksum = head_checksum(head);

  write_atomically(file, [&](const fs::path& temporary) {
    std::ofstream stream;
    stream.exceptions(std::ios::badbit | std::ios::failbit);
    stream.open(temporary, std::ios::binary);
    write_bytes(stream, std::as_bytes(std::span(&head, 1)));
    write_bytes(stream, table);
    for (const Array& array : arrays_) write_bytes(stream, array.bytes);
    stream.close();
  });
}

CheckpointReader::CheckpointReader(const fs::path& file) : file_(file) {
  errno = 0;
  std::error_code error;
  const std::uint64_t file_size = fs::file_size(file_, error);
  if (error) throw system_file_error(file_, "cannot be opened", error.value());
  stream_.open(file_, std::ios::binary);
  if (!stream_) throw system_file_error(file_, "cannot be opened", errno);
  read_table(file_size);
}

void CheckpointReader::read_table(std::uint64_t file_size) {
  Head head;
  if (file_size < sizeof head)
    throw file_error(file_,
                     "truncated: " + std::to_string(file_size) + " bytes are less than a checkpoint's head");
  fetch(0, std::as_writable_bytes(std::span(&head, 1)));
  if (head.magic != magic)
    throw file_error(file_, "not a checkpoint (its first eight bytes are not ANTICRCP)");
  if (head.byte_order_mark != byte_order_mark)
    throw file_error(file_, "damaged, or written on a machine of another byte order");
  if (head.head_checksum != head_checksum(head))
    throw file_error(file_, "damaged: the checksum of its head differs");
  if (head.format_version != format_version)
    throw InputError(file_.string() + ": checkpoint format " + std::to_string(head.format_version) +
                     ", but this program (anticrack " + std::string(program_version()) + ") reads format " +
                     std::to_string(format_version) + ". Go on with the program that wrote it.");
  if (head.table_bytes > file_size - sizeof head) throw file_error(file_, "truncated: its table is cut off");

  std::vector<std::byte> table(head.table_bytes);
  fetch(sizeof head, table);
  if (checksum(table) != head.table_checksum)
    throw file_error(file_, "damaged: the checksum of its table differs");

  TableReader reader(table);
  std::uint64_t end = sizeof head + head.table_bytes;
  for (std::uint64_t i = 0; i < head.array_count; ++i) {
    std::uint32_t name_size = 0;
    std::string name;
    Array array{};
    bool complete = reader.take(name_size) && name_size <= reader.left();
    if (complete) name.resize(name_size);
    complete = complete && reader.take(std::as_writable_bytes(std::span(name))) && reader.take(array.type) &&
               reader.take(array.element_size) && reader.take(array.count) && reader.take(array.offset) &&
               reader.take(array.checksum);
    if (!complete || array.offset != end || array.element_size == 0)
      throw file_error(file_, "entry " + std::to_string(i) + " of its table is not valid");
    if (array.offset > file_size || array.count > (file_size - array.offset) / array.element_size)
      throw array_error(file_, name,
                        "truncated: it should end at byte " +
                            std::to_string(array.offset + array.count * array.element_size) +
                            ", the file has " + std::to_string(file_size));
    end += array.count * array.element_size;
    arrays_.emplace(std::move(name), array);
  }
  if (end != file_size)
    throw file_error(file_,
                     std::to_string(file_size) + " bytes; its table accounts for " + std::to_string(end));
}

std::string CheckpointReader::read_text(std::string_view name) {
  const auto letters = read<std::uint8_t>(name);
  return {letters.begin(), letters.end()};
}

const CheckpointReader::Array& CheckpointReader::array(std::string_view name) const {
  const auto found = arrays_.find(name);
  if (found == arrays_.end()) throw array_error(file_, name, "missing");
  return found->second;
}

std::size_t CheckpointReader::count_of_type(std::string_view name, char type) const {
  const Array& found = array(name);
  if (found.type != type)
    throw array_error(file_, name, std::string("of type '") + found.type + "', expected '" + type + "'");
  return found.count;
}

void CheckpointReader::read_bytes(std::string_view name, char type, std::span<std::byte> bytes) {
  const std::uint64_t count = count_of_type(name, type);
  const Array& found = array(name);
  if (count * found.element_size != bytes.size())
    throw array_error(
        file_, name,
        std::to_string(count) + " entries, expected " + std::to_string(bytes.size() / found.element_size));
  fetch(found.offset, bytes);
  if (checksum(bytes) != found.checksum) throw array_error(file_, name, "damaged: its checksum differs");
}

void CheckpointReader::verify() {
  std::uint64_t largest = 0;
  for (const auto& [name, array] : arrays_) largest = std::max(largest, array.count * array.element_size);
  std::vector<std::byte> buffer(std::min<std::uint64_t>(piece, largest));
  for (const auto& [name, array] : arrays_) {
    std::uint32_t sum = 0;
    const std::uint64_t size = array.count * array.element_size;
    for (std::uint64_t at = 0; at < size; at += piece) {
      const auto part = std::span(buffer).first(std::min<std::uint64_t>(piece, size - at));
      fetch(array.offset + at, part);
      sum = checksum(part, sum);
    }
    if (sum != array.checksum) throw array_error(file_, name, "damaged: its checksum differs");
  }
}

void CheckpointReader::fetch(std::uint64_t offset, std::span<std::byte> bytes) {
  errno = 0;
  stream_.clear();
  stream_.seekg(std::streamoff(offset));
  stream_.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size()));
  if (!stream_) throw system_file_error(file_, "cannot be read", errno);
}

fs::path checkpoint_file(const fs::path& folder, std::int64_t step) {
  std::string digits = std::to_string(step);
  digits.insert(0, digits.size() < 10 ? 10 - digits.size() : 0, '0');
  return folder / ("checkpoint_" + digits + ".bin");
}

void keep_last_two_checkpoints(const fs::path& folder, const fs::path& newest) {
  auto files = list_checkpoints(folder);
  const auto found = std::ranges::find(files, newest);
  if (found == files.end()) throw file_error(newest, "not there");
  const std::size_t place = std::size_t(found - files.begin());
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (i == place || i + 1 == place) continue;
    std::error_code error;
    fs::remove(files[i], error);
    if (error) throw system_file_error(files[i], "cannot be removed", error.value());
  }
}

fs::path newest_valid_checkpoint(const fs::path& folder, std::vector<std::string>& damaged) {
  auto files = list_checkpoints(folder);
  std::ranges::reverse(files);
  for (const fs::path& file : files) {
    try {
      CheckpointReader(file).verify();
      return file;
    } catch (const FileError& error) {
      damaged.push_back(error.what());
    }
  }
  throw file_error(
      folder,
      files.empty()
          ? "no checkpoint in it; the run was stopped before its first and can only begin anew (--force)"
          : "every checkpoint in it is damaged");
}

}  // namespace anticrack
