#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <csignal>
#include <stdexcept>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "spoilt.h"

namespace etalon {
namespace {

using testing::Change;
using testing::check;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ofSuccess;
using testing::Spoilt;
using Verdict = ContractCheck::Verdict;

void unchanged(const InitializationProblem& /*problem*/, InitializationResult* /*result*/) {}

void expectFailure(const std::string& name, const Change& change, const std::string& words) {
  const ContractCheck result = check(name, Spoilt(change));
  EXPECT_EQ(result.verdict, Verdict::kFailed) << name << ": " << result.detail;
  EXPECT_THAT(result.detail, HasSubstr(words)) << name;
}

TEST(Contract, LetsAGoodInitializerPass) {
  ContractOptions options;
  options.timed_calls = 3;
  options.monte_carlo_windows = 10;
  int called = 0;
  const ContractReport report =
      checkContract(Spoilt(unchanged), options, [&](const ContractCheck&) { ++called; });
  for (const ContractCheck& c : report.checks)
    EXPECT_NE(c.verdict, Verdict::kFailed) << c.name << ": " << c.detail;
  EXPECT_TRUE(report.ok());
  EXPECT_GT(report.milliseconds_per_call, 0.0);
  EXPECT_EQ(called, static_cast<int>(report.checks.size()));
  EXPECT_EQ(report.checks.size(), contractChecks().size());
}

TEST(Contract, RefusesTheNameOfACheckThatIsNone) {
  ContractOptions options;
  options.only = {"exact.gentel"};
  try {
    checkContract(Spoilt(unchanged), options);
    FAIL() << "no exception";
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr("did you mean 'exact.gentle'?"));
  }
}

TEST(Contract, FindsWhatIsNotExact) {
  // Each by twice its bound, the others untouched.
  expectFailure("exact.gentle", ofSuccess([](auto* r) { r->bias.gyro.x() += 2e-5; }), "b_g 2e-05");
  expectFailure("exact.circle", ofSuccess([](auto* r) { r->bias.accel.z() -= 2e-3; }), "b_a 0.002");
  expectFailure("exact.gentle", ofSuccess([](auto* r) {
                  for (StampedState& s : r->states) s.v_WB.x() += 2e-4;
                }),
                "velocity 0.0002 m/s (at most");
  expectFailure("exact.standstill", ofSuccess([](auto* r) {
                  const SE3 tilt(expSO3({0.01 * M_PI / 180, 0, 0}), Eigen::Vector3d::Zero());
                  for (StampedState& s : r->states) s.T_WB = tilt * s.T_WB;
                }),
                "gravity 0.01 deg (at most");
  expectFailure("exact.gentle", ofSuccess([](auto* r) {
                  for (auto& [id, p_W] : r->landmarks) p_W.z() += 2e-3;
                }),
                "landmarks 0.002 m (at most");
}

TEST(Contract, AllowsRefusalsWithAReasonButNotEverywhere) {
  const Spoilt always([](const InitializationProblem&, InitializationResult* result) {
    *result = refuse(RefusalStatus::kTooLittleMotion, "too dull");
  });
  const ContractCheck one = check("exact.gentle", always);
  EXPECT_EQ(one.verdict, Verdict::kRefused);
  EXPECT_EQ(one.detail, "too_little_motion: too dull");
  ContractOptions options;
  options.only = {"exact."};
  const ContractReport report = checkContract(always, options);
  EXPECT_EQ(report.checks.back().name, "exact.somewhere");
  EXPECT_EQ(report.checks.back().verdict, Verdict::kFailed);

  expectFailure(
      "exact.gentle",
      [](const InitializationProblem&, InitializationResult* result) {
        *result = refuse(RefusalStatus::kTooLittleMotion);
      },
      "without a reason");
}

TEST(Contract, FindsWrongAndMissingResponsesToBiases) {
  expectFailure("response.gyro_bias", ofSuccess([](auto* r) { r->bias.gyro *= -1.0; }), "b_g");
  expectFailure("response.gyro_bias", ofSuccess([](auto* r) { r->bias.gyro.setZero(); }), "b_g");
  expectFailure("response.accel_bias", ofSuccess([](auto* r) { r->bias.accel *= -1.0; }),
                "against its direction");
  const Spoilt pinned(ofSuccess([](auto* r) { r->bias.accel.setZero(); }));
  EXPECT_EQ(check("response.accel_bias", pinned).verdict, Verdict::kPassed);
}

TEST(Contract, FindsWhatDependsOnMoreThanTheProblem) {
  int calls = 0;
  expectFailure("deterministic", ofSuccess([&calls](auto* r) {
                  r->landmarks.begin()->second.x() += 1e-15 * ++calls;
                }),
                "differs when asked again");
  expectFailure(
      "invariant.time_origin",
      [](const InitializationProblem& problem, InitializationResult* result) {
        if (!*result) return;
        // Absolute time in seconds, as a double.
        const double t0 = 1e-9 * static_cast<double>(problem.frames()[0].t);
        const double t1 = 1e-9 * static_cast<double>(problem.frames()[1].t);
        (*result)->states[1].v_WB *= (t1 - t0) / 0.05;
      },
      "velocity");
  expectFailure(
      "invariant.time_origin",
      [](const InitializationProblem& problem, InitializationResult* result) {
        if (!*result) return;
        // The same of keyframes: a quarter of a second would come out exactly.
        const double t0 = 1e-9 * static_cast<double>(problem.keyframe(0).t);
        const double t1 = 1e-9 * static_cast<double>(problem.keyframe(1).t);
        (*result)->states[1].v_WB *=
            (t1 - t0) / (1e-9 * static_cast<double>(problem.keyframe(1).t - problem.keyframe(0).t));
      },
      "velocity");
}

TEST(Contract, NamesTheWorstWindowAndListsTheOthers) {
  // Each window is off by more than the one before.
  double error = 0.1;
  const ContractCheck gyro = check(
      "response.gyro_bias", Spoilt(ofSuccess([&](auto* r) { r->bias.gyro.x() += error += 0.1; })));
  EXPECT_EQ(gyro.verdict, Verdict::kFailed);
  ASSERT_EQ(gyro.failures.size(), 12U);
  EXPECT_THAT(gyro.failures.front(), HasSubstr("standstill, opposite bias: b_g 1.3"));
  EXPECT_THAT(gyro.failures.back(), HasSubstr("gentle: b_g 0.2"));
  EXPECT_EQ(gyro.detail, gyro.failures.front() + "; 11 more windows failed");

  // Two of the windows without a gap of 0.2 s are answered.
  const ContractCheck gap = check("status.imu_gap", Spoilt(ofSuccess([](auto* r) {
                                    for (StampedState& s : r->states) s.v_WB.x() += 0.5;
                                  })));
  EXPECT_EQ(gap.failures.size(), 2U);
  EXPECT_THAT(gap.detail, HasSubstr("; 1 more window failed"));
}

TEST(Contract, AsksForTheUsualMistakesWhereTheyAreClear) {
  expectFailure("exact.gentle", ofSuccess([](auto* r) {
                  const SE3 flip(expSO3({M_PI, 0, 0}), Eigen::Vector3d::Zero());
                  for (StampedState& s : r->states) s.T_WB = flip * s.T_WB;
                }),
                "; does gravity point up?");
  expectFailure("exact.circle", ofSuccess([](auto* r) {
                  for (StampedState& s : r->states) s.v_WB = s.T_WB.R.transpose() * s.v_WB;
                }),
                "; velocity expressed in the body frame?");
  expectFailure("exact.circle", ofSuccess([](auto* r) {
                  const Eigen::Matrix3d R_B0W = r->states.front().T_WB.R.transpose();
                  for (StampedState& s : r->states) s.v_WB = R_B0W * s.v_WB;
                }),
                "; velocity expressed in the frame of the first keyframe?");
  expectFailure("response.gyro_bias", ofSuccess([](auto* r) { r->bias.gyro *= -1.0; }),
                "; the sign of b_g?");
  // These errors fit none of the known mistakes.
  const Spoilt noisy(ofSuccess([](auto* r) {
    r->bias.gyro.x() += 0.02;
    for (StampedState& s : r->states) s.v_WB.x() += 0.3;
  }));
  EXPECT_THAT(check("exact.circle", noisy).detail, Not(HasSubstr("?")));
  EXPECT_THAT(check("response.gyro_bias", noisy).detail, Not(HasSubstr("?")));
}

TEST(Contract, StopsAfterTwoChecksThatRanOutOfTime) {
  const Spoilt sleeps([](const InitializationProblem&, InitializationResult*) {
    while (true) pause();
  });
  ContractOptions options;
  options.only = {"parameters", "exact."};
  options.limits.clock_s = 2.0;
  const ContractReport report = checkContract(sleeps, options);
  ASSERT_EQ(report.checks.size(), 3U);
  EXPECT_EQ(report.checks[0].verdict, Verdict::kPassed);
  EXPECT_THAT(report.checks[1].detail, HasSubstr("did not end within 2 s"));
  EXPECT_EQ(report.stopped,
            "stopped: exact.gentle and exact.aggressive ran out of time; 4 checks were not run");
  EXPECT_FALSE(report.ok());
}

TEST(Contract, TheTimeOfABrokenAnswerIsNoTime) {
  expectFailure(
      "time",
      [](const InitializationProblem&, InitializationResult*) { throw Error("out of order"); },
      "throws: out of order");
  expectFailure("time",
                ofSuccess([](auto* r) { r->covariance = Eigen::MatrixXd::Constant(11, 11, NAN); }),
                "covariance not finite");
  expectFailure("time", ofSuccess([](auto* r) { r->states.pop_back(); }), "9 states for 10");
}

TEST(Contract, FindsWhatIsNoAnswer) {
  expectFailure("exact.gentle", ofSuccess([](auto* r) { r->states.back().v_WB.y() = NAN; }),
                "not finite");
  expectFailure("exact.gentle", ofSuccess([](auto* r) { r->states.pop_back(); }), "states");
  expectFailure(
      "status.few_tracks",
      [](const InitializationProblem&, InitializationResult* result) {
        if (!*result) throw std::out_of_range("index 7 of 5");
      },
      "throws: index 7 of 5");
  expectFailure(
      "status.few_tracks",
      [](const InitializationProblem&, InitializationResult* result) {
        if (!*result) throw Error("an error instead of a status");
      },
      "throws: an error instead");
  expectFailure(
      "status.few_tracks",
      [](const InitializationProblem& problem, InitializationResult* result) {
        if (*result) return;
        Initialization made_up;
        for (int k = 0; k < problem.keyframeCount(); ++k)
          made_up.states.push_back({problem.keyframe(k).t, SE3(), {0.3, 0.0, 0.0}});
        *result = std::move(made_up);
      },
      "is called a success");
}

TEST(Contract, SurvivesWhatKillsTheProcess) {
  expectFailure(
      "status.few_tracks",
      [](const InitializationProblem&, InitializationResult* result) {
        if (*result) return;
        std::signal(SIGSEGV, SIG_DFL);
        std::raise(SIGSEGV);
      },
      "crashed with signal 11");
}

TEST(Contract, FindsFalseDeclarations) {
  Spoilt lies(unchanged);
  lies.says_needs_ = false;
  EXPECT_THAT(check("needs", lies).detail, HasSubstr("says that it does not"));
  Spoilt silent(unchanged);
  silent.documentation_ = "";
  EXPECT_THAT(check("parameters", silent).detail, HasSubstr("'key' has no documentation"));
}

}  // namespace
}  // namespace etalon
