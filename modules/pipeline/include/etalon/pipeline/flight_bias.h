#pragma once

#include <vector>

#include "etalon/core/refusal.h"
#include "etalon/imu/bias_prediction.h"
#include "etalon/imu/bias_priors.h"
#include "etalon/pipeline/frame_estimate.h"

namespace etalon {

/**
 * The biases of a flight as its fixed-lag odometry found them: the mean over the frames that are
 * settled, from ten seconds after the start on, weighted by their variance. The last estimate would
 * be no better: it has followed the bias to where that has wandered. The standard error is that of batch means, which takes the
 * correlation in time into account (Law and Kelton, Simulation Modeling and Analysis), but no less
 * than what the odometry says of itself.
 *
 * A frame is settled if all axes are known to half of what `priors` say, so that what is found is
 * the flight's own and not the prior's echo, as at rest.
 *
 * @return refused: too_few_keyframes where less than ten seconds are settled, ill_conditioned where
 *         the odometry was lost, or never ran
 */
Expected<FlightBias> biasOfFlight(const std::vector<FrameEstimate>& estimates,
                                  const BiasPriors& priors);

}  // namespace etalon
