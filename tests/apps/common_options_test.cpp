#include "common_options.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "errors.h"
#include "expect_error.h"
#include "nearest_name.h"

namespace anticrack {
namespace {

TEST(ThreadCount, PrefersTheOptionThenSlurmThenTheAffinityMask) {
  unsetenv("SLURM_CPUS_PER_TASK");
  EXPECT_GE(thread_count({}), 1);
  setenv("SLURM_CPUS_PER_TASK", "7", 1);
  EXPECT_EQ(thread_count({}), 7);
  CommonOptions options;
  options.threads = 3;
  EXPECT_EQ(thread_count(options), 3);
  for (const char* wrong : {"0", "-1", "two", "2x"}) {
    setenv("SLURM_CPUS_PER_TASK", wrong, 1);
    EXPECT_ERROR(thread_count({}), InputError,
                 "; expected a positive whole number. Use --threads to overrule it.")
        << wrong;
  }
  unsetenv("SLURM_CPUS_PER_TASK");
}

TEST(ThreadLimit, HoldsWhileItLives) {
  const auto limit = tbb::global_control::max_allowed_parallelism;
  const std::size_t before = tbb::global_control::active_value(limit);
  {
    const ThreadLimit one(1);
    EXPECT_EQ(tbb::global_control::active_value(limit), 1u);
  }
  EXPECT_EQ(tbb::global_control::active_value(limit), before);
}

TEST(NearestName, FindsSlipsOfTheKeyboardOnly) {
  const std::vector<std::string> names = {"generate", "run", "render", "info"};
  EXPECT_EQ(nearest_name("rnu", names), "run");
  EXPECT_EQ(nearest_name("generat", names), "generate");
  EXPECT_EQ(nearest_name("redner", names), "render");
  EXPECT_EQ(nearest_name("xyz", names), "");
}

}  // namespace
}  // namespace anticrack
