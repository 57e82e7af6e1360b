#include "files/atomic_file.h"

#include "io_test_folder.h"

namespace anticrack {
namespace {

class AtomicFile : public IoTest {};

TEST_F(AtomicFile, ReplacesTheOldTextByTheNew) {
  const auto file = folder / "result.json";
  write_text_atomically(file, "old");
  EXPECT_EQ(file_content(file), "old");
  write_text_atomically(file, "new and longer");
  EXPECT_EQ(file_content(file), "new and longer");
  EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(AtomicFile, OldFileStaysUntilTheNewOneIsComplete) {
  const auto file = folder / "state";
  write_text_atomically(file, "old");
  write_atomically(file, [&](const auto& temporary) {
    EXPECT_EQ(temporary.parent_path(), folder);
    put_file(temporary, "half of the n");
    EXPECT_EQ(file_content(file), "old");
  });
  EXPECT_EQ(file_content(file), "half of the n");
}

TEST_F(AtomicFile, FailureInWritingLeavesTheOldFileAndNoTemporary) {
  const auto file = folder / "state";
  write_text_atomically(file, "old");
  const auto fail = [](const auto& temporary) {
    put_file(temporary, "half");
    throw NumericalError("not finite");
  };
  EXPECT_THROW(write_atomically(file, fail), NumericalError);
  EXPECT_EQ(file_content(file), "old");
  EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(AtomicFile, FullDiskIsAnErrorWithFileAndReason) {
  const auto file = folder / "state";
  write_text_atomically(file, "old");
  std::string message;
  {
    const FullDisk full(10000);
    message = file_error_of([&] { write_text_atomically(file, std::string(20000, 'x')); });
  }
  EXPECT_PRED_FORMAT2(testing::IsSubstring, file.string(), message);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "File too large", message);
  EXPECT_EQ(file_content(file), "old");
  EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(AtomicFile, MissingFolderIsAnErrorWithFileAndReason) {
  const auto file = folder / "nowhere" / "state";
  const std::string message = file_error_of([&] { write_text_atomically(file, "text"); });
  EXPECT_PRED_FORMAT2(testing::IsSubstring, file.string(), message);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "No such file or directory", message);
}

TEST_F(AtomicFile, UnwritableFolderIsAnErrorWithFileAndReason) {
  const auto file = folder / "state";
  std::string message;
  {
    const UnwritableFolder unwritable(folder);
    message = file_error_of([&] { write_text_atomically(file, "text"); });
  }
  EXPECT_PRED_FORMAT2(testing::IsSubstring, file.string(), message);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "Permission denied", message);
}

TEST_F(AtomicFile, PlaceTakenByAFolderIsAnError) {
  std::filesystem::create_directories(folder / "state" / "inner");
  const std::string message = file_error_of([&] { write_text_atomically(folder / "state", "text"); });
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "directory", message);
  EXPECT_EQ(files_in_folder(), 1u);
}

}  // namespace
}  // namespace anticrack
