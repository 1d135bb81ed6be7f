#include "suite/progress_report.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace etalon {
namespace {

TEST(ProgressReport, CountsUpAndEstimatesWhatIsLeft) {
  std::vector<BenchmarkProgress> calls;
  BenchmarkOptions options;
  options.progress = [&calls](const BenchmarkProgress& progress) { calls.push_back(progress); };
  ProgressReport report(options.progress, BenchmarkProgress::Stage::kWindows, 10);
  report.add(0);  // there is no rate yet
  EXPECT_TRUE(calls.empty());
  report.add(4);
  report.add(6);
  ASSERT_EQ(calls.size(), 2U);
  EXPECT_EQ(calls[0].stage, BenchmarkProgress::Stage::kWindows);
  EXPECT_EQ(calls[0].done, 4U);
  EXPECT_EQ(calls[0].total, 10U);
  EXPECT_DOUBLE_EQ(calls[0].remaining_s, calls[0].elapsed_s * 6.0 / 4.0);
  EXPECT_EQ(calls[1].done, 10U);
  EXPECT_GE(calls[1].elapsed_s, calls[0].elapsed_s);
  EXPECT_EQ(calls[1].remaining_s, 0.0);
}

TEST(ProgressReport, IsCalledByOneThreadAtATime) {
  int inside = 0, most = 0;
  size_t last = 0;
  BenchmarkOptions options;
  options.progress = [&](const BenchmarkProgress& progress) {
    most = std::max(most, ++inside);
    EXPECT_GT(progress.done, last);
    last = progress.done;
    --inside;
  };
  ProgressReport report(options.progress, BenchmarkProgress::Stage::kFrontEnd, 400);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&report] {
      for (int i = 0; i < 100; ++i) report.add(1);
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(most, 1);
  EXPECT_EQ(last, 400U);
}

TEST(ProgressReport, NobodyNeedsToListen) {
  ProgressReport report(nullptr, BenchmarkProgress::Stage::kWindows, 1);
  EXPECT_NO_THROW(report.add(1));
}

}  // namespace
}  // namespace etalon
