#include "output_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "errors.h"
#include "expect_error.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

std::string refusal(const fs::path& path, ExistingFolder existing) {
  try {
    check_output_folder(path, existing);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(OutputFolder, IsCreatedWithItsParents) {
  const TemporaryFolder folder;
  static_cast<void>(prepare_output_folder(folder.path() / "a/b", ExistingFolder::refuse));
  EXPECT_TRUE(fs::is_directory(folder.path() / "a/b"));
}

TEST(OutputFolder, MayExistIfEmpty) {
  const TemporaryFolder folder;
  EXPECT_NO_THROW(static_cast<void>(prepare_output_folder(folder.path(), ExistingFolder::refuse)));
}

TEST(OutputFolder, IsRefusedIfItHoldsAnything) {
  const TemporaryFolder folder;
  folder.write("notes.txt", "mine");
  EXPECT_EQ(
      refusal(folder.path(), ExistingFolder::refuse),
      folder.path().string() +
          ": the output folder exists and is not empty. Use --resume to go on with the run in it, --force to "
          "replace that run, or another -o.");
}

TEST(OutputFolder, CheckChangesNothingOnDisk) {
  const TemporaryFolder folder;
  folder.write("run/scene.toml", "");
  check_output_folder(folder.path() / "new", ExistingFolder::refuse);
  check_output_folder(folder.path() / "run", ExistingFolder::replace);
  EXPECT_FALSE(fs::exists(folder.path() / "new"));
  EXPECT_TRUE(fs::exists(folder.path() / "run/scene.toml"));
}

TEST(OutputFolder, PreparingKeepsWhatIsThere) {
  const TemporaryFolder folder;
  const fs::path history = folder.write("history.csv", "");
  static_cast<void>(prepare_output_folder(folder.path(), ExistingFolder::replace));
  EXPECT_TRUE(fs::exists(history));
}

TEST(OutputFolder, RemovesOnlyWhatARunWrites) {
  const TemporaryFolder folder;
  const std::vector<fs::path> of_run = {folder.write("scene.toml", ""),
                                        folder.write("history.csv", ""),
                                        folder.write("result.json", ""),
                                        folder.write("provenance.json", ""),
                                        folder.write("frames/frame_0001.vdb", ""),
                                        folder.write("frames/frame_0001.vtp", ""),
                                        folder.write("frames/frames.pvd", ""),
                                        folder.write("checkpoint/checkpoint_0000000100.bin", "")};
  const std::vector<fs::path> foreign = {folder.write("notes.txt", ""), folder.write("frames/best.png", ""),
                                         folder.write("frames/frame_0001.vdb.backup", ""),
                                         folder.write("plots/history.csv", "")};
  remove_run(folder.path());
  for (const fs::path& file : of_run) EXPECT_FALSE(fs::exists(file)) << file;
  for (const fs::path& file : foreign) EXPECT_TRUE(fs::exists(file)) << file;
}

TEST(OutputFolder, ResumingKeepsTheRunAndNeedsOne) {
  const TemporaryFolder folder;
  const fs::path scene = folder.write("run/scene.toml", "");
  static_cast<void>(prepare_output_folder(folder.path() / "run", ExistingFolder::resume));
  EXPECT_TRUE(fs::exists(scene));
  EXPECT_EQ(refusal(folder.path() / "none", ExistingFolder::resume),
            (folder.path() / "none").string() + ": no run to resume: there is no scene.toml in it.");
}

TEST(OutputFolder, IsRefusedWhereNothingCanBeCreated) {
  const TemporaryFolder folder;
  const fs::path file = folder.write("file", "");
  EXPECT_EQ(refusal(file / "run", ExistingFolder::refuse),
            (file / "run").string() + ": cannot write there: " + file.string() + " is not a folder.");
  EXPECT_EQ(refusal(file, ExistingFolder::replace),
            file.string() + ": cannot write there: " + file.string() + " is not a folder.");
}

TEST(OutputFolder, IsRefusedWhereTheUserMayNotWrite) {
  const TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms(0555));
  const bool is_root = geteuid() == 0;
  ASSERT_EQ(seteuid(is_root ? 65534 : geteuid()), 0);  // root may write anywhere, nobody may not
  const std::string message = refusal(folder.path() / "run", ExistingFolder::refuse);
  ASSERT_EQ(seteuid(is_root ? 0 : geteuid()), 0);
  fs::permissions(folder.path(), fs::perms::owner_all);
  EXPECT_EQ(message, (folder.path() / "run").string() + ": cannot write to " + folder.path().string() +
                         ": Permission denied.");
}

TEST(OutputFolder, ThatCannotBeCreatedOrOpenedIsAnErrorWithTheReason) {
  const TemporaryFolder folder;
  const fs::path longer = folder.path() / "a" / std::string(300, 'x');
  EXPECT_ERROR(static_cast<void>(prepare_output_folder(longer, ExistingFolder::refuse)), FileError,
               longer.string() + ": cannot create the output folder: File name too long.");
  EXPECT_ERROR(FolderLock(folder.path() / "none"), FileError,
               "none: cannot open the folder: No such file or directory.");
}

TEST(OutputFolder, IsRefusedWhileAnotherRunWritesThere) {
  const TemporaryFolder folder;
  {
    const FolderLock lock = prepare_output_folder(folder.path(), ExistingFolder::refuse);
    EXPECT_ERROR(
        static_cast<void>(prepare_output_folder(folder.path(), ExistingFolder::refuse)), InputError,
        folder.path().string() + ": another run is writing there. Wait for its end, or use another -o.");
  }
  EXPECT_NO_THROW(static_cast<void>(prepare_output_folder(folder.path(), ExistingFolder::refuse)));
}

TEST(OutputFile, IsNotOverwrittenWithoutForce) {
  const TemporaryFolder folder;
  const fs::path file = folder.write("a.vdb", "");
  EXPECT_ERROR(check_output_file(file, false), InputError,
               "a.vdb: the file exists. Use --force to replace it, or another -o.");
  EXPECT_NO_THROW(check_output_file(file, true));
  EXPECT_NO_THROW(check_output_file(folder.path() / "new/b.vdb", false));
  EXPECT_ERROR(check_output_file(folder.path(), true), InputError, ": is a folder; expected a file.");
  EXPECT_ERROR(check_output_file(file / "b.vdb", true), InputError, "a.vdb is not a folder.");
}

}  // namespace
}  // namespace anticrack
