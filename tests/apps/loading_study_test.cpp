#include <gtest/gtest.h>

#include "loading_cases.h"
#include "observables/loading_law.h"

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

}  // namespace
}  // namespace anticrack
