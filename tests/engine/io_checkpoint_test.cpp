#include "io/checkpoint.h"

#include <libdeflate.h>

#include <cmath>
#include <cstring>

#include "expect_error.h"
#include "io/provenance.h"
#include "io_test_folder.h"

namespace anticrack {
namespace {

constexpr std::string_view scene = "[sample]\nsize = [1, 1, 1]\n";

class Checkpoint : public IoTest {
 protected:
  // A file with every element type and an array of no entries.
  void write_some(const std::filesystem::path& at) const {
    CheckpointWriter writer(scene);
    writer.add<double>("x", x);
    writer.add<float>("weight", weight);
    writer.add<std::int32_t>("cell", cell);
    writer.add<std::uint32_t>("id", id);
    writer.add<std::int64_t>("signed", signed_long);
    writer.add<std::uint64_t>("unsigned", unsigned_long);
    writer.add<std::uint8_t>("flag", flag);
    writer.add<double>("nothing", {});
    writer.add_value<std::int64_t>("step", 8000);
    writer.add_value("time", 0.125);
    writer.write(at);
  }

  // Reads all, checked; false if the reader says that the file is not as it was written.
  bool reads(const std::filesystem::path& at) const {
    try {
      CheckpointReader reader(at);
      reader.verify();
      EXPECT_EQ(reader.read<double>("x"), x);
      EXPECT_EQ(reader.read<std::uint8_t>("flag"), flag);
      return true;
    } catch (const FileError& error) {
      EXPECT_PRED_FORMAT2(testing::IsSubstring, at.filename().string(), error.what());
      return false;
    }
  }

  std::filesystem::path file = folder / "checkpoint.bin";
  std::vector<double> x = {0.1, -0.0, 1e300, 5e-324, 3};
  std::vector<float> weight = {0.5f, 1e-40f};
  std::vector<std::int32_t> cell = {-1, 0, 2147483647};
  std::vector<std::uint32_t> id = {4294967295u, 7};
  std::vector<std::int64_t> signed_long = {INT64_MIN};
  std::vector<std::uint64_t> unsigned_long = {UINT64_MAX};
  std::vector<std::uint8_t> flag = {0, 255, 1};
};

TEST_F(Checkpoint, ReadsBackEveryTypeBitForBit) {
  write_some(file);
  CheckpointReader reader(file);
  reader.verify();
  EXPECT_EQ(reader.read<double>("x"), x);
  EXPECT_TRUE(std::signbit(reader.read<double>("x")[1]));
  EXPECT_EQ(reader.read<float>("weight"), weight);
  EXPECT_EQ(reader.read<std::int32_t>("cell"), cell);
  EXPECT_EQ(reader.read<std::uint32_t>("id"), id);
  EXPECT_EQ(reader.read<std::int64_t>("signed"), signed_long);
  EXPECT_EQ(reader.read<std::uint64_t>("unsigned"), unsigned_long);
  EXPECT_EQ(reader.read<std::uint8_t>("flag"), flag);
  EXPECT_EQ(reader.read<double>("nothing"), std::vector<double>());
  EXPECT_EQ(reader.read_value<std::int64_t>("step"), 8000);
  EXPECT_EQ(reader.read_value<double>("time"), 0.125);
  EXPECT_EQ(reader.count("x"), 5u);
  EXPECT_TRUE(reader.contains("id"));
  EXPECT_FALSE(reader.contains("kappa"));
}

TEST_F(Checkpoint, ReadsIntoMemoryOfTheCaller) {
  write_some(file);
  std::vector<std::int32_t> values(3);
  CheckpointReader(file).read<std::int32_t>("cell", values);
  EXPECT_EQ(values, cell);
}

TEST_F(Checkpoint, SameStateGivesSameBytes) {
  write_some(file);
  write_some(folder / "again.bin");
  EXPECT_EQ(file_content(file), file_content(folder / "again.bin"));
}

TEST_F(Checkpoint, KnowsItsSceneAndItsProgram) {
  write_some(file);
  CheckpointReader reader(file);
  EXPECT_EQ(reader.scene(), scene);
  EXPECT_EQ(reader.program(), program_version());
}

TEST_F(Checkpoint, OfAnotherFormatIsRefusedByBothNumbersAndNotTakenForDamaged) {
  write_some(checkpoint_file(folder, 1));
  write_some(checkpoint_file(folder, 2));
  std::string other = file_content(checkpoint_file(folder, 2));
  const std::uint32_t now = std::uint8_t(other[12]);
  other[12] = 77;
  const std::uint32_t checksum = libdeflate_crc32(0, other.data(), 36);
  std::memcpy(&other[36], &checksum, 4);
  put_file(checkpoint_file(folder, 2), other);
  std::vector<std::string> damaged;
  try {
    newest_valid_checkpoint(folder, damaged);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), checkpoint_file(folder, 2).string() +
                                             ": checkpoint format 77, but this program (anticrack " +
                                             std::string(program_version()) + ") reads format " +
                                             std::to_string(now) + ". Go on with the program that wrote it.");
  }
  EXPECT_TRUE(damaged.empty());
}

// With checksums that hold: no damage, but a writer that is not ours.
TEST_F(Checkpoint, WithATableThatContradictsItselfIsRefusedByItsEntry) {
  write_some(file);
  std::string bytes = file_content(file);
  const auto put = [&](std::size_t at, auto value) { std::memcpy(&bytes[at], &value, sizeof value); };
  const auto checksum = [&](std::size_t begin, std::size_t size) {
    return libdeflate_crc32(0, bytes.data() + begin, size);
  };
  std::uint64_t table_size = 0;
  std::memcpy(&table_size, &bytes[24], 8);
  const std::size_t second = 40 + 29 + std::strlen("program");
  ASSERT_EQ(bytes.substr(second + 4, 5), "scene");
  put(second + 4 + 5 + 1, std::uint32_t(0));  // bytes of an element
  put(32, std::uint32_t(checksum(40, table_size)));
  put(36, std::uint32_t(checksum(0, 36)));
  put_file(file, bytes);
  EXPECT_ERROR(CheckpointReader reader(file), FileError, "checkpoint.bin: entry 1 of its table is not valid");
}

TEST_F(Checkpoint, WrongRequestsAreErrorsWithFileAndArray) {
  write_some(file);
  CheckpointReader reader(file);
  const auto says = [&](const auto& request, const char* what) {
    EXPECT_PRED_FORMAT2(testing::IsSubstring, what, file_error_of(request));
    EXPECT_PRED_FORMAT2(testing::IsSubstring, "checkpoint.bin", file_error_of(request));
  };
  says([&] { reader.read<double>("kappa"); }, "array \"kappa\": missing");
  says([&] { reader.read<float>("x"); }, "array \"x\": of type 'd', expected 'f'");
  says([&] { reader.read_value<double>("x"); }, "array \"x\": 5 entries, expected 1");
}

TEST_F(Checkpoint, TakesEachNameOnce) {
  CheckpointWriter writer(scene);
  writer.add<double>("x", x);
  EXPECT_ERROR(writer.add<float>("x", weight), InputError, "array \"x\" is there already");
  EXPECT_ERROR(writer.add_value("x", 1.0), InputError, "array \"x\" is there already");
}

TEST_F(Checkpoint, EveryFlippedBitIsNoticed) {
  write_some(file);
  const std::string good = file_content(file);
  ASSERT_TRUE(reads(file));
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    std::string bad = good;
    bad[bit / 8] = char(bad[bit / 8] ^ (1 << bit % 8));
    put_file(file, bad);
    EXPECT_FALSE(reads(file)) << "bit " << bit;
  }
}

TEST_F(Checkpoint, EveryTruncationAndExtensionIsNoticed) {
  write_some(file);
  const std::string good = file_content(file);
  for (std::size_t size = 0; size < good.size(); ++size) {
    put_file(file, good.substr(0, size));
    EXPECT_FALSE(reads(file)) << size << " bytes";
  }
  put_file(file, good + '\0');
  EXPECT_FALSE(reads(file));
}

TEST_F(Checkpoint, ErrorsNameTheDamagedArray) {
  write_some(file);
  std::string bad = file_content(file);
  bad.back() ^= 1;  // "time" is the last
  put_file(file, bad);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "checkpoint.bin: array \"time\": damaged",
                      file_error_of([&] { CheckpointReader(file).verify(); }));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "checkpoint.bin: array \"time\": damaged",
                      file_error_of([&] { CheckpointReader(file).read_value<double>("time"); }));
  // The others can still be read.
  EXPECT_EQ(CheckpointReader(file).read<double>("x"), x);
}

TEST_F(Checkpoint, OtherFilesAreRefused) {
  put_file(file, "");
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "truncated",
                      file_error_of([&] { CheckpointReader reader(file); }));
  put_file(file, std::string(1000, 'x'));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "not a checkpoint",
                      file_error_of([&] { CheckpointReader reader(file); }));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "No such file",
                      file_error_of([&] { CheckpointReader reader(folder / "none.bin"); }));
}

TEST_F(Checkpoint, FullDiskIsAnErrorAndKeepsTheOldFile) {
  write_some(file);
  const std::string good = file_content(file);
  std::vector<double> large(10000);
  CheckpointWriter writer(scene);
  writer.add<double>("x", large);
  std::string message;
  {
    const FullDisk full(50000);
    message = file_error_of([&] { writer.write(file); });
  }
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "checkpoint.bin", message);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "File too large", message);
  EXPECT_EQ(file_content(file), good);
  EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(Checkpoint, LastTwoAreKept) {
  for (const std::int64_t step : {9, 80, 700, 123456}) write_some(checkpoint_file(folder, step));
  keep_last_two_checkpoints(folder, checkpoint_file(folder, 123456));
  EXPECT_EQ(files_in_folder(), 2u);
  EXPECT_TRUE(std::filesystem::exists(checkpoint_file(folder, 700)));
  EXPECT_TRUE(std::filesystem::exists(checkpoint_file(folder, 123456)));
  keep_last_two_checkpoints(folder, checkpoint_file(folder, 123456));
  EXPECT_EQ(files_in_folder(), 2u);
}

// Otherwise it would count as one of the two for good, and the next damage would leave none.
TEST_F(Checkpoint, ADamagedOneOfALaterStepDoesNotCount) {
  write_some(checkpoint_file(folder, 100));
  put_file(checkpoint_file(folder, 200), "damaged");
  for (const std::int64_t step : {150, 160}) {
    write_some(checkpoint_file(folder, step));
    keep_last_two_checkpoints(folder, checkpoint_file(folder, step));
  }
  EXPECT_EQ(files_in_folder(), 2u);
  EXPECT_TRUE(std::filesystem::exists(checkpoint_file(folder, 150)));
  EXPECT_TRUE(std::filesystem::exists(checkpoint_file(folder, 160)));
}

TEST_F(Checkpoint, NewestValidOneIsFoundBehindADamagedOne) {
  write_some(checkpoint_file(folder, 100));
  write_some(checkpoint_file(folder, 1000));
  std::vector<std::string> damaged;
  EXPECT_EQ(newest_valid_checkpoint(folder, damaged), checkpoint_file(folder, 1000));
  EXPECT_TRUE(damaged.empty());

  std::string bad = file_content(checkpoint_file(folder, 1000));
  bad[bad.size() - 20] ^= 1;
  put_file(checkpoint_file(folder, 1000), bad);
  EXPECT_EQ(newest_valid_checkpoint(folder, damaged), checkpoint_file(folder, 100));
  ASSERT_EQ(damaged.size(), 1u);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "checkpoint_0000001000.bin: array", damaged[0]);

  put_file(checkpoint_file(folder, 100), "");
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "every checkpoint in it is damaged",
                      file_error_of([&] { newest_valid_checkpoint(folder, damaged); }));
}

TEST_F(Checkpoint, FolderWithoutCheckpointsIsAnError) {
  std::vector<std::string> damaged;
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "no checkpoint",
                      file_error_of([&] { newest_valid_checkpoint(folder, damaged); }));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "no checkpoint in it; the run was stopped before its first",
                      file_error_of([&] { newest_valid_checkpoint(folder / "none", damaged); }));
  put_file(folder / "file", "");
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "cannot be listed",
                      file_error_of([&] { newest_valid_checkpoint(folder / "file", damaged); }));
}

}  // namespace
}  // namespace anticrack
