#include "suite/parallel.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>
#include <string>

namespace etalon {
namespace {

TEST(InParallel, DoesEveryItemOnceWhateverTheJobs) {
  for (const int jobs : {-1, 0, 1, 2, 3, 100}) {
    std::vector<std::atomic<int>> done(17);
    inParallel(jobs, done.size(), [&](size_t i) { ++done[i]; });
    for (size_t i = 0; i < done.size(); ++i) EXPECT_EQ(done[i], 1) << jobs << " jobs, item " << i;
  }
}

TEST(InParallel, OneJobWorksInOrderInTheCallersThread) {
  std::vector<size_t> order;
  std::set<std::thread::id> threads;
  inParallel(1, 5, [&](size_t i) {
    order.push_back(i);
    threads.insert(std::this_thread::get_id());
  });
  EXPECT_EQ(order, (std::vector<size_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(threads, std::set<std::thread::id>{std::this_thread::get_id()});
}

TEST(InParallel, OfNothingNothingIsDone) {
  inParallel(4, 0, [](size_t) { FAIL() << "called"; });
}

TEST(InParallel, TheFirstExceptionEndsTheWork) {
  for (const int jobs : {1, 4}) {
    std::atomic<int> begun{0};
    try {
      inParallel(jobs, 100'000, [&](size_t i) {
        ++begun;
        if (i == 3) throw std::runtime_error("item " + std::to_string(i));
      });
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& e) {
      EXPECT_STREQ(e.what(), "item 3");
    }
    if (jobs == 1) {
      EXPECT_EQ(begun, 4);  // the other threads' progress depends on timing
    }
  }
}

}  // namespace
}  // namespace etalon
