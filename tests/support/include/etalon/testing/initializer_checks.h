#pragma once

#include <functional>
#include <string>

#include "etalon/initialization/initializer.h"
#include "etalon/testing/synthetic_window.h"

// What the unit tests of all initializers share. Checks are assertions of GoogleTest.
namespace etalon::testing {

/** Those whose excitation tells an accelerometer's bias from gravity. */
constexpr Motion kExcitingMotions[] = {Motion::kGentle, Motion::kAggressive, Motion::kCircle,
                                       Motion::kPureRotation};

/** Biases of a worn IMU, all components different. */
inline const ImuBias kBiases{{0.02, -0.06, 0.04}, {0.1, -0.08, 0.12}};

/**
 * The initializer of a plugin library, its parameters read from the lines of its INI section.
 * @throws PluginError, ConfigError
 */
Initializer::Ptr loadInitializer(const std::string& library, const std::string& ini = "");

/** What an initializer makes of a window. */
struct Outcome {
  SyntheticWindow window;
  InitializationResult result;
  WindowErrors errors;  ///< if there is a result
};
Outcome runOn(const SyntheticWindow& window, const SyntheticWindowOptions& options,
              const Initializer& initializer);
Outcome runOn(const SyntheticWindowOptions& options, const Initializer& initializer);

/** Without noise and biases, in motion that tells everything from everything. */
SyntheticWindowOptions moving();
/** Half a pixel of noise, the IMU's data sheet, and outliers; the problem knows of the noise. */
SyntheticWindowOptions noisyOptions(Motion motion, double outlier_share, const ImuBias& bias);
/** No noise, the biases `bias`, and priors that do not pull on them. */
SyntheticWindowOptions freeOptions(Motion motion, const ImuBias& bias);

/** The bars for noise-free data. */
constexpr WindowErrors kNumericalPrecision{0, 1e-4, 1e-5, 0.01, 1e-4, 1e-5, 1e-5};

/** Every error is below its bound; infinity judges nothing. */
void expectWithin(const WindowErrors& errors, const WindowErrors& bounds);
/** A success, and expectWithin(). */
void expectWithin(const Outcome& outcome, const WindowErrors& bounds);
/** A refusal of this status whose reason has these words in it. */
void expectRefusal(const InitializationResult& result, RefusalStatus status,
                   const std::string& words);

/** Exact with unknown biases before VI-BA and after it, and accepted; `initializer` is to have its
 * priors switched off, for they would (rightly) pull. */
void expectExactBeforeAndAfterViBa(const Initializer& initializer);
/** Exact without biases, before VI-BA and after it, and accepted: at rest and at constant velocity,
 * too. */
void expectExactWhereThePriorsAreTrue(const Initializer& initializer);
/** Noise and 10 % outliers: accepted, and accurate after VI-BA. */
void expectAccurateAfterViBa(const Initializer& initializer);

/** Exact, but for what weak priors on b_g pull, where nothing accelerates: b_g is the only bias. */
void expectExactAtRestAndAtConstantVelocity(const Initializer& initializer);
/** Noise, and 30 % of the matches of two keyframes wrong: accurate all the same. */
void expectSurvivesThirtyPercentOutliers(const Initializer& initializer, Motion motion);
/** Noise, and 30 % of the observations wrong: still a start, for those whose poses are stereo
 * odometry's. */
void expectSurvivesOutliersOfStereoOdometry(const Initializer& initializer);

/** A window of keyframes alone whose biases are drawn from the priors, with the data sheet's white
 * noise on the IMU and `sigma_px` on the pixels. */
SyntheticWindowOptions drawnOptions(Motion motion, unsigned seed, double sigma_px);
/** makeSyntheticWindow() with hardly any random walk believed of its biases, which do not walk. */
SyntheticWindow withoutBiasWalk(const SyntheticWindowOptions& options);
/** Mean velocity error (m/s) of ten gentle windows with 0.5 and with 1 px of noise: below 0.006
 * m/s a pixel and 0.001. Errors in variables grow with the square of the noise. */
void expectErrsInProportionToThePixelNoise(const Initializer& initializer);
/** Average NEES of 40 aggressive windows with 0.1 and with 0.5 px of noise, of the first 11 errors,
 * each of their blocks and the poses: 1 within three standard deviations and `slack`.
 * @param least_answers windows that may not be refused, of the 40 */
void expectErrsAsItsCovarianceSays(const Initializer& initializer, double slack,
                                   int least_answers = 40);

/** Two instances on two copies of a window, with VI-BA: the same bits. */
void expectSameBits(const std::function<Initializer::Ptr()>& load,
                    const SyntheticWindowOptions& options);
/** The same on a gentle window with noise. */
void expectSameBits(const std::function<Initializer::Ptr()>& load);

/** Five tracks a frame: refused in words, by the initializer and by the attempt as a whole.
 * @return the refusal */
InitializationResult expectRefusesTooFewTracks(const Initializer& initializer);
/** No landmark is seen in two frames: refused in words. */
void expectRefusesTracksWithoutOverlap(const Initializer& initializer);
/** 5 px of noise where 0.5 are believed: refused in words. */
void expectRefusesTracksNoisierThanBelieved(const Initializer& initializer);
/** At rest, an accelerometer that measures a twentieth of gravity: refused in words. */
void expectRefusesAnAccelerometerThatShowsNoGravity(const Initializer& initializer);
/** A gap of 0.2 s in the IMU, and a pixel that is not a number: refused with the status of each. */
void expectRefusesBrokenInput(const Initializer& initializer);

}  // namespace etalon::testing
