#include <cerrno>
#include <functional>

#include "engine/io_frame_samples.h"
#include "fault/failing_calls.h"
#include "images/write_image.h"
#include "images/write_mesh.h"
#include "io/checkpoint.h"
#include "io/frame.h"
#include "io/history.h"
#include "io/run_result.h"
#include "io_test_folder.h"
#include "microstructure_io.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

struct Writer {
  std::string file;
  std::function<void(const fs::path& folder, int state)> write;  ///< states differ in their content
};

void write_some_checkpoint(const fs::path& folder, int state) {
  const std::vector<double> values(5000, state);
  CheckpointWriter writer("scene");
  writer.add<double>("x", values);
  writer.write(folder / "checkpoint.bin");
}

void write_some_image(const fs::path& file, int state) {
  PhaseImage image{{6, 5, 4}, 1e-6, std::vector<std::uint8_t>(120, 0)};
  image.solid[std::size_t(state)] = 1;
  write_image(slices_of(image), file);
}

Frame frame_of_state(int state) {
  Frame frame = sample_frame(9);
  frame.header.time = state;
  return frame;
}

const Writer writers[] = {
    {"checkpoint.bin", write_some_checkpoint},
    {"frame_0012.vdb", [](const fs::path& folder, int state) { write_frame(frame_of_state(state), folder); }},
    {"frame_0012.vtp",
     [](const fs::path& folder, int state) { write_paraview_frame(frame_of_state(state), folder); }},
    {"result.json",
     [](const fs::path& folder, int state) {
       RunResult result{};
       result.steps = state;
       write_run_result(result, folder / "result.json");
     }},
    {"s.vdb",
     [](const fs::path& folder, int state) {
       Microstructure structure = full_block({{8, 8, 8}, 1.0});
       structure.metadata["state"] = std::int64_t(state);
       write_microstructure(structure, folder / "s.vdb");
     }},
    {"image.tif", [](const fs::path& folder, int state) { write_some_image(folder / "image.tif", state); }},
    {"image.nrrd", [](const fs::path& folder, int state) { write_some_image(folder / "image.nrrd", state); }},
    {"mesh.ply",
     [](const fs::path& folder, int state) {
       write_mesh({{{0, 0, float(state)}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}, folder / "mesh.ply");
     }},
};

class FailedWrite : public IoTest, public testing::WithParamInterface<Writer> {};

INSTANTIATE_TEST_SUITE_P(Of, FailedWrite, testing::ValuesIn(writers), [](const auto& writer) {
  std::string name = writer.param.file;
  std::erase_if(name, [](char letter) { return !std::isalnum(letter); });
  return name;
});

// Whichever call fails, once or from there on: an error with the system's reason, and a file that is whole.
TEST_P(FailedWrite, IsAnErrorAndLeavesTheOldFileOrTheNew) {
  const auto& [name, write] = GetParam();
  const fs::path file = folder / name;
  write(folder, 2);
  const std::string newer = file_content(file);
  write(folder, 1);
  const std::string older = file_content(file);
  ASSERT_NE(older, newer);
  const std::size_t files = files_in_folder();

  for (const auto& [error_number, reason] :
       {std::pair(ENOSPC, "No space left on device"), std::pair(EIO, "Input/output error")}) {
    for (const auto extent : {FailingCalls::Extent::one, FailingCalls::Extent::from_there_on}) {
      for (int number = 0;; ++number) {
        std::string message;
        std::vector<std::string> calls;
        {
          const FailingCalls failing(number, error_number, extent);
          message = file_error_of([&] { write(folder, 2); });
          calls = FailingCalls::recorded();
        }
        if (int(calls.size()) <= number) {
          EXPECT_EQ(message, "");
          EXPECT_GT(number, 3);  // write, flush, rename, flush of the folder at least
          break;
        }
        EXPECT_PRED_FORMAT2(testing::IsSubstring, reason, message) << calls[std::size_t(number)];
        EXPECT_PRED_FORMAT2(testing::IsSubstring, folder.string(), message);
        const std::string now = file_content(file);
        EXPECT_TRUE(now == older || now == newer) << calls[std::size_t(number)];
        EXPECT_EQ(files_in_folder(), files) << "a temporary is left";
        write(folder, 1);
      }
      write(folder, 1);
    }
  }
}

TEST_P(FailedWrite, EachFileIsFlushedThenRenamedThenItsFolderFlushed) {
  const auto& [name, write] = GetParam();
  const FailingCalls calls(-1, 0, FailingCalls::Extent::one);
  write(folder, 1);
  const std::vector<std::string> all = FailingCalls::recorded();
  const auto rename = std::ranges::find_if(all, [&](const std::string& call) {
    return call.starts_with("rename ") && call.ends_with(' ' + name);
  });
  ASSERT_NE(rename, all.end());
  const std::string temporary = rename->substr(7, rename->size() - 8 - name.size());
  EXPECT_NE(temporary, name);
  ASSERT_NE(rename, all.begin());
  EXPECT_EQ(*(rename - 1), "fsync " + temporary);
  ASSERT_NE(rename + 1, all.end());
  EXPECT_EQ(*(rename + 1), "fsync " + folder.filename().string());
  EXPECT_EQ(std::count(rename, all.end(), "write " + temporary), 0);
  EXPECT_EQ(std::ranges::count(all, "write " + name), 0);
}

class History : public IoTest {};

TEST_F(History, RowThatCannotBeWrittenIsAnErrorAndTheRowsBeforeStay) {
  HistoryWriter writer(folder / "history.csv");
  writer.append({});
  std::string message;
  {
    const FailingCalls failing(0, ENOSPC, FailingCalls::Extent::one);
    message = file_error_of([&] { writer.append({}); });
  }
  EXPECT_EQ(message, (folder / "history.csv").string() + ": cannot be written: No space left on device");
  EXPECT_EQ(read_history(folder / "history.csv").size(), 1u);
}

}  // namespace
}  // namespace anticrack
