#include "etalon/contract/contract.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <csignal>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>

#include "etalon/contract/synthetic_window.h"
#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/initialization/plugin_loader.h"

namespace etalon::test_plugins {

using Change = std::function<void(const InitializationProblem&, InitializationResult*)>;

/** A good initializer whose results are spoilt on the way out. */
class Spoilt : public Initializer {
  DEFINE_MRPT_OBJECT(Spoilt, etalon::test_plugins)

 public:
  Spoilt() = default;
  explicit Spoilt(Change change) : change_(std::move(change)) {
    good_ = PluginLoader({ETALON_INITIALIZERS}).create("orbslam3_inertial_only");
  }
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("key", &number_, {0, 9}, documentation_);
  }
  bool needsVisualSolution() const override { return says_needs_; }

  std::string documentation_ = "A number.";
  bool says_needs_ = true;

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    InitializationResult result = good_->initialize(problem);
    change_(problem, &result);
    return result;
  }

 private:
  Initializer::Ptr good_;
  Change change_ = [](const InitializationProblem&, InitializationResult*) {};
  int number_ = 1;
};

IMPLEMENTS_MRPT_OBJECT(Spoilt, etalon::Initializer, etalon::test_plugins)

}  // namespace etalon::test_plugins

namespace etalon {
namespace {

using test_plugins::Change;
using test_plugins::Spoilt;
using ::testing::HasSubstr;
using ::testing::Not;
using Verdict = ContractCheck::Verdict;

void unchanged(const InitializationProblem& /*problem*/, InitializationResult* /*result*/) {}

/** The verdict of one check. */
ContractCheck check(const std::string& name, const Initializer& initializer,
                    ContractOptions options = {}) {
  options.only = {name};
  options.limits.cpu_s = 100.0;
  const ContractReport report = checkContract(initializer, options);
  EXPECT_EQ(report.checks.size(), 1U);
  return report.checks.front();
}

void expectFailure(const std::string& name, const Change& change, const std::string& words) {
  const ContractCheck result = check(name, Spoilt(change));
  EXPECT_EQ(result.verdict, Verdict::kFailed) << name << ": " << result.detail;
  EXPECT_THAT(result.detail, HasSubstr(words)) << name;
}

/** A change of successes alone. */
Change ofSuccess(const std::function<void(Initialization*)>& change) {
  return [change](const InitializationProblem&, InitializationResult* result) {
    if (*result) change(&**result);
  };
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
  EXPECT_EQ(report.checks.size(), contractChecks().size() + 1);  // and "exact.somewhere"
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
                  for (KeyframeState& s : r->states) s.v_WB.x() += 2e-4;
                }),
                "velocity 0.0002 m/s (at most");
  expectFailure("exact.standstill", ofSuccess([](auto* r) {
                  const SE3 tilt(expSO3({0.01 * M_PI / 180, 0, 0}), Eigen::Vector3d::Zero());
                  for (KeyframeState& s : r->states) s.T_WB = tilt * s.T_WB;
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
                                    for (KeyframeState& s : r->states) s.v_WB.x() += 0.5;
                                  })));
  EXPECT_EQ(gap.failures.size(), 2U);
  EXPECT_THAT(gap.detail, HasSubstr("; 1 more window failed"));
}

TEST(Contract, AsksForTheUsualMistakesWhereTheyAreClear) {
  expectFailure("exact.gentle", ofSuccess([](auto* r) {
                  const SE3 flip(expSO3({M_PI, 0, 0}), Eigen::Vector3d::Zero());
                  for (KeyframeState& s : r->states) s.T_WB = flip * s.T_WB;
                }),
                "; does gravity point up?");
  expectFailure("exact.circle", ofSuccess([](auto* r) {
                  for (KeyframeState& s : r->states) s.v_WB = s.T_WB.R.transpose() * s.v_WB;
                }),
                "; velocity expressed in the body frame?");
  expectFailure("exact.circle", ofSuccess([](auto* r) {
                  const Eigen::Matrix3d R_B0W = r->states.front().T_WB.R.transpose();
                  for (KeyframeState& s : r->states) s.v_WB = R_B0W * s.v_WB;
                }),
                "; velocity expressed in the frame of the first keyframe?");
  expectFailure("response.gyro_bias", ofSuccess([](auto* r) { r->bias.gyro *= -1.0; }),
                "; the sign of b_g?");
  // Nothing is clear here.
  const Spoilt noisy(ofSuccess([](auto* r) {
    r->bias.gyro.x() += 0.02;
    for (KeyframeState& s : r->states) s.v_WB.x() += 0.3;
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

/** The truth of a drawn window with an error of known covariance on it: what the Monte Carlo wants.
 * The scale is that of the covariance that is given against the one that is true. */
class Drawn : public Initializer {
  DEFINE_MRPT_OBJECT(Drawn, etalon)

 public:
  explicit Drawn(double scale = 1.0) : scale_(scale) {}
  void declareParameters(ParameterSet& /*parameters*/) override {}
  bool needsVisualSolution() const override { return false; }
  bool singular_ = false, lopsided_ = false, unknown_ = false;

 protected:
  static constexpr double kSigmaTilt = 0.24, kSigmaVelocity = 0.81;  // rad, m/s

  InitializationResult solve(const InitializationProblem& problem) const override {
    Initialization result;
    for (int k = 0; k < problem.keyframeCount(); ++k)
      result.states.push_back({problem.keyframe(k).t, SE3(), Eigen::Vector3d::Zero()});
    // Knows nothing of the motion: b_g and b_a are the prior's, and so are their covariances.
    // Attitude and velocity are as large as those of the windows are.
    result.bias = problem.priors().mean;
    Eigen::VectorXd variances(11);
    variances.segment<2>(6).setConstant(std::pow(kSigmaTilt, 2));
    variances.segment<3>(8).setConstant(std::pow(kSigmaVelocity, 2));
    if (unknown_) variances.tail<5>().setConstant(1e12);
    variances.head<3>().setConstant(std::pow(problem.priors().sigma_gyro_rps, 2));
    variances.segment<3>(3).setConstant(std::pow(problem.priors().sigma_accel_mps2, 2));
    result.covariance = scale_ * variances.asDiagonal().toDenseMatrix();
    if (singular_) result.covariance.bottomRightCorner<3, 3>().setZero();
    if (lopsided_) result.covariance(0, 1) = 0.5 * result.covariance(0, 0);
    return result;
  }

 private:
  double scale_;
};

IMPLEMENTS_MRPT_OBJECT(Drawn, etalon::Initializer, etalon)

TEST(Contract, JudgesCovariances) {
  const Spoilt without(ofSuccess([](auto* r) { r->covariance.resize(0, 0); }));
  for (const char* name : {"covariance.positive_definite", "covariance.consistent"}) {
    const ContractCheck none = check(name, without);
    EXPECT_EQ(none.verdict, Verdict::kNotApplicable);
    EXPECT_THAT(none.detail, HasSubstr("gives none"));
  }
  // One that is ten times too good in velocity alone.
  const Spoilt sure(ofSuccess([](auto* r) {
    r->covariance.bottomRows(3) *= 0.3;
    r->covariance.rightCols(3) *= 0.3;
  }));
  const ContractCheck optimistic = check("covariance.consistent", sure);
  EXPECT_EQ(optimistic.verdict, Verdict::kFailed);
  EXPECT_THAT(optimistic.detail, HasSubstr("velocity: too optimistic"));

  Drawn honest(1.0), lopsided(1.0), singular(1.0);
  lopsided.lopsided_ = singular.singular_ = true;
  EXPECT_EQ(check("covariance.positive_definite", honest).verdict, Verdict::kPassed);
  EXPECT_THAT(check("covariance.positive_definite", lopsided).detail, HasSubstr("not symmetric"));
  const ContractCheck not_definite = check("covariance.positive_definite", singular);
  EXPECT_EQ(not_definite.verdict, Verdict::kFailed);
  EXPECT_THAT(not_definite.detail, HasSubstr("not positive definite"));
}

TEST(Contract, ComparesErrorsWithTheCovarianceByMonteCarlo) {
  ContractOptions options;
  options.monte_carlo_windows = 60;
  const ContractCheck honest = check("covariance.consistent", Drawn(1.0), options);
  EXPECT_EQ(honest.verdict, Verdict::kPassed) << honest.detail;
  EXPECT_NEAR(honest.value, 1.0, 0.2);
  const ContractCheck pessimistic = check("covariance.consistent", Drawn(3.0), options);
  EXPECT_EQ(pessimistic.verdict, Verdict::kFailed);
  EXPECT_THAT(pessimistic.detail, HasSubstr("all: too pessimistic"));
  const ContractCheck optimistic = check("covariance.consistent", Drawn(1.0 / 3.0), options);
  EXPECT_EQ(optimistic.verdict, Verdict::kFailed);
  EXPECT_THAT(optimistic.detail, HasSubstr("all: too optimistic"));
  // Gravity and velocity as good as unknown: only six of eleven degrees of freedom contribute. 11/6
  // too much in these and nothing in the others cancel in the sum, but no block is right.
  Drawn unknown(6.0 / 11.0);
  unknown.unknown_ = true;
  const ContractCheck cancelled = check("covariance.consistent", unknown, options);
  EXPECT_EQ(cancelled.verdict, Verdict::kFailed);
  EXPECT_NEAR(cancelled.value, 1.0, 0.2);
  EXPECT_THAT(cancelled.detail,
              AllOf(HasSubstr("b_g: too optimistic"), HasSubstr("velocity: too pessimistic")));
  options.allowed_nees_factor = 4.0;
  EXPECT_EQ(check("covariance.consistent", Drawn(1.0 / 3.0), options).verdict, Verdict::kPassed);
  // Where a part is singular, the other blocks alone.
  Drawn singular(1.0);
  singular.singular_ = true;
  EXPECT_THAT(check("covariance.consistent", singular, options).detail,
              HasSubstr("velocity singular"));
}

TEST(EstimationError, TakesYawOutAndTiltAboutTheWorldsAxes) {
  testing::SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  const testing::SyntheticWindow window = testing::makeSyntheticWindow(options);
  const Eigen::Vector3d tilt(0.01, -0.02, 0.0), dv(0.1, 0.2, -0.3);
  const Eigen::Matrix3d yaw = expSO3({0.0, 0.0, 2.5});
  Initialization result;
  result.states = window.truth;
  for (KeyframeState& s : result.states) {
    s.T_WB.R = expSO3(tilt) * yaw * s.T_WB.R;
    s.v_WB = yaw * s.v_WB + dv;
  }
  result.bias.gyro = {1e-3, 2e-3, 3e-3};
  const Eigen::Matrix<double, 11, 1> error = estimationError(result, window);
  Eigen::Matrix<double, 11, 1> expected;
  expected << 1e-3, 2e-3, 3e-3, 0, 0, 0, tilt.head<2>(), dv;
  EXPECT_LT((error - expected).norm(), 1e-12);
}

}  // namespace
}  // namespace etalon
