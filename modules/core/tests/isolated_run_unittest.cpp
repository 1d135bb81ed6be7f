#include "etalon/core/process/isolated_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

namespace etalon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(IsolatedRun, GivesBackWhatTheFunctionReturns) {
  const std::string long_text(300'000, 'x');  // more than a pipe holds
  const IsolatedOutcome outcome = runIsolated([&] { return long_text + "\n\0end"; }, {});
  EXPECT_TRUE(outcome.completed) << outcome.failure;
  EXPECT_EQ(outcome.output, long_text + "\n\0end");
}

TEST(IsolatedRun, WhatIsToldBeforeACrashHasArrived) {
  const std::string long_text(300'000, 'x');
  std::vector<std::string> told;
  const IsolatedOutcome outcome = runIsolated(
      [&](const TextSink& tell) {
        tell("one");
        tell(long_text);
        tell("");
        _exit(3);
        return std::string("never");
      },
      {}, [&told](const std::string& text) { told.push_back(text); });
  EXPECT_FALSE(outcome.completed);
  EXPECT_THAT(outcome.failure, HasSubstr("exit code 3"));
  EXPECT_THAT(told, ElementsAre("one", long_text, ""));
}

TEST(IsolatedRun, EndsTheChildWhenTheCallerHasHeardEnough) {
  pid_t child = 0;
  EXPECT_THROW(runIsolated(
                   [](const TextSink& tell) -> std::string {
                     tell(std::to_string(getpid()));
                     while (true) pause();
                   },
                   {},
                   [&child](const std::string& text) {
                     child = std::stoi(text);
                     throw std::runtime_error("enough");
                   }),
               std::runtime_error);
  EXPECT_EQ(kill(child, 0), -1);
}

TEST(IsolatedRun, LeavesTheCallersMemoryAlone) {
  int value = 1;
  runIsolated([&] { return std::to_string(value = 2); }, {});
  EXPECT_EQ(value, 1);
}

TEST(IsolatedRun, SurvivesACrash) {
  // Not dereferenced: a sanitizer would turn that into an exit.
  const IsolatedOutcome outcome = runIsolated(
      [] {
        std::signal(SIGSEGV, SIG_DFL);
        std::raise(SIGSEGV);
        return std::string();
      },
      {});
  EXPECT_FALSE(outcome.completed);
  EXPECT_THAT(outcome.failure, HasSubstr("crashed with signal 11"));
  EXPECT_FALSE(outcome.out_of_time);
}

TEST(IsolatedRun, EndsALoop) {
  IsolationLimits limits;
  limits.cpu_s = 1.0;
  limits.clock_s = 100.0;  // a busy machine is not the matter here
  const IsolatedOutcome outcome = runIsolated(
      []() -> std::string {
        volatile bool forever = true;
        while (forever) {
        }
        return "";
      },
      limits);
  EXPECT_THAT(outcome.failure, HasSubstr("more than 1 s of processor time"));
  EXPECT_TRUE(outcome.out_of_time);
}

#ifndef __SANITIZE_ADDRESS__
TEST(IsolatedRun, EndsAnAllocationWithoutEnd) {
  IsolationLimits limits;
  limits.memory_gib = 1.0;
  const IsolatedOutcome outcome =
      runIsolated([] { return std::string(2'000'000'000, 'x').substr(0, 1); }, limits);
  EXPECT_THAT(outcome.failure, HasSubstr("threw: std::bad_alloc"));
  // What the caller has does not count.
  const std::string mine(1'500'000'000, 'x');
  EXPECT_TRUE(
      runIsolated([&mine] { return mine.substr(0, 1) + std::string(100'000'000, 'y'); }, limits)
          .completed);
}
#endif

TEST(IsolatedRun, EndsAWait) {
  IsolationLimits limits;
  limits.clock_s = 1.0;
  const IsolatedOutcome outcome = runIsolated(
      []() -> std::string {
        while (true) pause();
      },
      limits);
  EXPECT_THAT(outcome.failure, HasSubstr("did not end within 1 s"));
  EXPECT_TRUE(outcome.out_of_time);
}

TEST(IsolatedRun, AllowsTwiceTheProcessorTimeOnTheClockUnlessToldOtherwise) {
  IsolationLimits limits;
  limits.cpu_s = 20.0;
  EXPECT_EQ(limits.clockSeconds(), 40.0);
  limits.clock_s = 7.0;
  EXPECT_EQ(limits.clockSeconds(), 7.0);
}

TEST(IsolatedRun, SaysHowItEndedOtherwise) {
  EXPECT_THAT(runIsolated([]() -> std::string { _exit(0); }, {}).failure,
              HasSubstr("ended the process with exit code 0"));
  EXPECT_THAT(runIsolated([]() -> std::string { throw std::out_of_range("too far"); }, {}).failure,
              HasSubstr("threw: too far"));
  EXPECT_THAT(runIsolated([]() -> std::string { throw 42; }, {}).failure,
              HasSubstr("no std::exception"));
}

}  // namespace
}  // namespace etalon
