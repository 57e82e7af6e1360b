#include <gtest/gtest.h>

#include "errors.h"
#include "expect_error.h"
#include "loading_cases.h"
#include "loading_study.h"
#include "observables/loading_law.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

TEST(LoadingStudy, AFasterLoadingFailsLaterAndHigherByWhatTheLawAllows) {
  const LoadingSeries series = loading_series().front();
  const LoadingCase slow = run_loading_case(series, 16), fast = run_loading_case(series, 64);
  // Four times the rate: a quarter of the passages, were it not for the later failure.
  EXPECT_LT(fast.passages, 0.5 * slow.passages);
  EXPECT_GT(fast.passages, 0.25 * slow.passages);
  EXPECT_GT(fast.strain, slow.strain);
  const double stronger = fast.stress / slow.stress - 1, stiffer = fast.modulus / slow.modulus - 1;
  EXPECT_GT(stronger, 0.1);
  EXPECT_LT(stronger, loading_law::failure_stress_error(fast.passages));
  EXPECT_GT(stiffer, 0);
  EXPECT_LT(stiffer, loading_law::modulus_error(fast.passages));
}

TEST(LoadingStudy, RefusesACaseOfAnEarlierRunThatItCannotRead) {
  const TemporaryFolder folder;
  for (const char* text : {"{", "{}", R"({"sample": 1})"}) {
    const auto file = folder.write("loading/phi_0.5__seed_1_isotropic_1.json", text);
    const std::string message = message_of<FileError>([&] { study_loading(folder.path(), {.quiet = true}); });
    EXPECT_TRUE(message.starts_with(file.string() + ": [json.exception.")) << message;
    EXPECT_TRUE(message.ends_with("; remove it to run this case again.")) << message;
  }
}

}  // namespace
}  // namespace anticrack
