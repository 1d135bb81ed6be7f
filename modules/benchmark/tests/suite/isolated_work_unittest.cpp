#include "suite/isolated_work.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "etalon/core/errors.h"

namespace etalon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;
using Part = std::pair<std::size_t, std::size_t>;  // item, part

/** Work of 5 items with 3 parts each; a part answers "<item>/<part>" unless `misdeed` acts. */
struct Work {
  IsolatedWork work;
  std::map<Part, std::string> answers, losses;
  std::multiset<std::size_t> done;

  explicit Work(const std::function<void(Part)>& misdeed) {
    work.items = 5;
    work.parts = [](std::size_t) { return 3; };
    work.run = [misdeed](std::size_t item, std::size_t first, const DoPart& do_part) {
      for (std::size_t part = first; part < 3; ++part)
        do_part(part, [&] {
          misdeed({item, part});
          return std::to_string(item) + "/" + std::to_string(part);
        });
    };
    work.finished = [this](std::size_t item, std::size_t part, const std::string& answer) {
      EXPECT_TRUE(answers.emplace(Part(item, part), answer).second);
    };
    work.died = [this](std::size_t item, std::size_t part, const std::string& how, bool) {
      EXPECT_TRUE(losses.emplace(Part(item, part), how).second);
    };
    work.item_done = [this](std::size_t item) { done.insert(item); };
    work.stopped = [] { return false; };
  }
};

TEST(IsolatedWork, AllAnswersComeWhateverTheNumberOfWorkers) {
  for (const int jobs : {1, 2, 9}) {
    Work w([](Part) {});
    runIsolatedWork(jobs, 10.0, w.work);
    EXPECT_EQ(w.answers.size(), 15u);
    EXPECT_EQ(w.answers.at({4, 2}), "4/2");
    EXPECT_TRUE(w.losses.empty());
    EXPECT_THAT(w.done, UnorderedElementsAre(0, 1, 2, 3, 4));
  }
}

TEST(IsolatedWork, WhoDiesLosesOnePart) {
  Work w([](Part part) {
    if (part == Part(1, 1)) raise(SIGKILL);
    if (part == Part(2, 2)) _exit(0);
    if (part == Part(3, 0)) throw std::runtime_error("enough");
  });
  runIsolatedWork(2, 10.0, w.work);
  EXPECT_EQ(w.answers.size(), 12u);
  EXPECT_THAT(w.losses, UnorderedElementsAre(Pair(Part(1, 1), "crashed with signal 9 (Killed)"),
                                             Pair(Part(2, 2), "ended the process with exit code 0"),
                                             Pair(Part(3, 0), "threw: enough")));
  EXPECT_THAT(w.done, UnorderedElementsAre(0, 1, 2, 3, 4));
}

TEST(IsolatedWork, NoItemBeginsOnceItIsStopped) {
  Work w([](Part) {});
  w.work.stopped = [&w] { return !w.done.empty(); };
  runIsolatedWork(1, 10.0, w.work);
  EXPECT_EQ(w.answers.size(), 3u);
}

TEST(IsolatedWork, NoPartBeginsOnceItIsStopped) {
  Work w([](Part part) {
    if (part.second > 0) pause();  // would never end
  });
  int told = 0;
  w.work.stopped = [&w] { return !w.answers.empty(); };
  w.work.stopping = [&told] { ++told; };
  runIsolatedWork(1, 10.0, w.work);
  EXPECT_EQ(w.answers.size(), 1u);
  EXPECT_TRUE(w.losses.empty());
  EXPECT_TRUE(w.done.empty());
}

TEST(IsolatedWork, SaysOnceThatItStops) {
  Work w([](Part) { usleep(20000); });
  int asked = 0, told = 0;
  w.work.stopped = [&asked] { return ++asked > 1; };  // the first time is before the first item
  w.work.stopping = [&told] { ++told; };
  runIsolatedWork(1, 10.0, w.work);
  EXPECT_EQ(told, 1);
}

TEST(IsolatedWork, AWorkerKeepsToItsGroup) {
  // Items 0 and 2 are a group, and so are 1, 3 and 4.
  Work w([](Part) {});
  std::vector<std::size_t> order;
  w.work.group = [](std::size_t item) { return std::size_t{item != 0 && item != 2}; };
  w.work.item_done = [&order](std::size_t item) { order.push_back(item); };
  runIsolatedWork(1, 10.0, w.work);
  EXPECT_THAT(order, ElementsAre(0, 2, 1, 3, 4));
}

TEST(IsolatedWork, WorkersSpreadOverTheGroups) {
  // 0, 1, 2 | 3 | 4: item 0 lasts until 4 is done, which the other worker takes before 1 and 2.
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  std::map<std::size_t, std::string> process;
  Work w([](Part) {});
  w.work.group = [](std::size_t item) { return item < 3 ? 0 : item; };
  w.work.run = [&ends](std::size_t item, std::size_t, const DoPart& do_part) {
    char go;
    if (item == 0) {
      EXPECT_EQ(read(ends[0], &go, 1), 1);
    }
    for (std::size_t part = 0; part < 3; ++part)
      do_part(part, [] { return std::to_string(getpid()); });
  };
  w.work.finished = [&](std::size_t item, std::size_t part, const std::string& answer) {
    process[item] = answer;
    if (item == 4 && part == 2) {
      EXPECT_EQ(write(ends[1], "g", 1), 1);
    }
  };
  runIsolatedWork(2, 10.0, w.work);
  EXPECT_EQ(process.size(), 5u);
  EXPECT_EQ(process[3], process[4]);
  EXPECT_NE(process[0], process[3]);
  close(ends[0]);
  close(ends[1]);
}

TEST(IsolatedWork, WhatIsWrongOutsideOfThePartsEndsAll) {
  Work w([](Part) {});
  w.work.run = [](std::size_t, std::size_t, const DoPart&) { throw DataError("a.csv", 3, "no"); };
  EXPECT_THROW(runIsolatedWork(2, 10.0, w.work), DataError);
  w.work.run = [](std::size_t, std::size_t, const DoPart&) { _exit(7); };
  try {
    runIsolatedWork(2, 10.0, w.work);
    FAIL() << "went on";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("ended the process with exit code 7"));
  }
}

}  // namespace
}  // namespace etalon
