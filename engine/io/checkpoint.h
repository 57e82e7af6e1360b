#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace anticrack {

/// Element types a checkpoint can hold; the letter marks the type in the file.
template <class T>
inline constexpr char checkpoint_type_letter = 0;
template <>
inline constexpr char checkpoint_type_letter<double> = 'd';
template <>
inline constexpr char checkpoint_type_letter<float> = 'f';
template <>
inline constexpr char checkpoint_type_letter<std::int32_t> = 'i';
template <>
inline constexpr char checkpoint_type_letter<std::uint32_t> = 'I';
template <>
inline constexpr char checkpoint_type_letter<std::int64_t> = 'q';
template <>
inline constexpr char checkpoint_type_letter<std::uint64_t> = 'Q';
template <>
inline constexpr char checkpoint_type_letter<std::uint8_t> = 'B';

template <class T>
concept CheckpointElement = checkpoint_type_letter<T>
!= 0;

/// Writes named arrays into one checksummed file.
///
/// Layout, without gaps: magic, byte order mark, format version, sizes, CRC-32 of the table and of all
/// before; the table (name, type, element size, count, offset, CRC-32); the arrays. The first two are texts:
/// the program's version and the resolved scene.
class CheckpointWriter {
 public:
  /// `scene_text` is the resolved scene: a checkpoint resumes only the run that wrote it.
  explicit CheckpointWriter(std::string_view scene_text);

  /// Notes an array; its values are read in write(), not before, and must live until then.
  /// @throws InputError  if the name is taken
  template <CheckpointElement T>
  void add(std::string_view name, std::span<const T> values) {
    add_bytes(name, checkpoint_type_letter<T>, sizeof(T), std::as_bytes(values));
  }

  /// Copies one number. @throws InputError  if the name is taken
  template <CheckpointElement T>
  void add_value(std::string_view name, T value) {
    add_copy<T>(name, std::span<const T>(&value, 1));
  }

  /// Copies a small array. @throws InputError  if the name is taken
  template <CheckpointElement T>
  void add_copy(std::string_view name, std::span<const T> values) {
    const auto bytes = std::as_bytes(values);
    auto& kept = values_[std::string(name)];
    kept.assign(bytes.begin(), bytes.end());
    add_bytes(name, checkpoint_type_letter<T>, sizeof(T), kept);
  }

  /// Streams all arrays to `file`, atomically. @throws FileError
  void write(const std::filesystem::path& file) const;

 private:
  struct Array {
    std::string name;
    char type;
    std::uint32_t element_size;
    std::span<const std::byte> bytes;
  };

  void add_text(std::string_view name, std::string_view text);
  void add_bytes(std::string_view name, char type, std::size_t element_size,
                 std::span<const std::byte> bytes);

  std::vector<Array> arrays_;
  std::map<std::string, std::vector<std::byte>> values_;
};

/// Reads what CheckpointWriter wrote. Sizes are checked against the file's before anything is allocated, and
/// every array against its checksum; errors name file, array and what is wrong.
class CheckpointReader {
 public:
  /// Reads and checks the table.
  /// @throws FileError   it is damaged, or no checkpoint
  /// @throws InputError  it is of another format
  explicit CheckpointReader(const std::filesystem::path& file);

  const std::filesystem::path& file() const { return file_; }
  std::string program() { return read_text("program"); }  ///< version of the program that wrote it
  std::string scene() { return read_text("scene"); }      ///< resolved scene of the run that wrote it
  bool contains(std::string_view name) const { return arrays_.contains(name); }
  /// Entries of an array. @throws FileError  if there is none of that name
  std::size_t count(std::string_view name) const { return array(name).count; }

  /// @throws FileError  if the array is missing, of another type or length, or damaged
  template <CheckpointElement T>
  void read(std::string_view name, std::span<T> values) {
    read_bytes(name, checkpoint_type_letter<T>, std::as_writable_bytes(values));
  }

  template <CheckpointElement T>
  std::vector<T> read(std::string_view name) {
    std::vector<T> values(count_of_type(name, checkpoint_type_letter<T>));
    read<T>(name, std::span<T>(values));
    return values;
  }

  template <CheckpointElement T>
  T read_value(std::string_view name) {
    T value;
    read<T>(name, std::span<T>(&value, 1));
    return value;
  }

  /// Reads the whole file once against its checksums. @throws FileError
  void verify();

 private:
  struct Array {
    char type;
    std::uint32_t element_size;
    std::uint64_t count;
    std::uint64_t offset;
    std::uint32_t checksum;
  };

  void read_table(std::uint64_t file_size);
  std::string read_text(std::string_view name);
  const Array& array(std::string_view name) const;
  std::size_t count_of_type(std::string_view name, char type) const;
  void read_bytes(std::string_view name, char type, std::span<std::byte> bytes);
  void fetch(std::uint64_t offset, std::span<std::byte> bytes);

  std::filesystem::path file_;
  std::ifstream stream_;
  std::map<std::string, Array, std::less<>> arrays_;
};

/// `folder`/checkpoint_NNNNNNNNNN.bin, the file of a step; names sort by step.
std::filesystem::path checkpoint_file(const std::filesystem::path& folder, std::int64_t step);

/// Removes all checkpoints of `folder` but the newest, just written, and the one before it, which opens
/// should the newest be damaged. Those of later steps go too: they were damaged, or the run would have gone
/// on from them. @throws FileError
void keep_last_two_checkpoints(const std::filesystem::path& folder, const std::filesystem::path& newest);

/// The newest checkpoint of `folder` whose every checksum holds; what is wrong with the newer ones goes to
/// `damaged`.
/// @throws FileError  if there is none. @throws InputError  if it is of another format
std::filesystem::path newest_valid_checkpoint(const std::filesystem::path& folder,
                                              std::vector<std::string>& damaged);

}  // namespace anticrack
