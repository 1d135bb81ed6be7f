#pragma once

#include "etalon/pipeline/window_initialization.h"

namespace etalon {

/**
 * Whether an attempt says what the one before it said about a shorter window, or one that ended a
 * keyframe earlier: b_g, b_a, gravity in the body at the earliest keyframe of both, and the velocity
 * at the end of the earlier window. Their difference d has no larger covariance than the earlier
 * estimate, P, as long as the later one knows all that the earlier knew and more, so d^T P^-1 d is
 * held against chi-square of 11 degrees of freedom, at `false_alarm_rate` and with `noise_margin`,
 * as the residuals are (judge()).
 * Refused with kTooFewKeyframes where there is nothing to compare: the earlier attempt has no
 * estimate with a covariance, its VI-BA has not converged, or the windows share fewer than two
 * keyframes.
 */
Expected<void> agree(const InitializationAttempt& earlier, const InitializationAttempt& later,
                     const AcceptanceOptions& options);

/** Attempts at growing windows: what `attempt` was accepted with alone is not enough, it must agree
 * with the attempt before; null: there is none.
 * @return false if it was accepted alone, and there is nothing to compare it with */
bool confirm(const InitializationAttempt* earlier, const AcceptanceOptions& options,
             InitializationAttempt* attempt);

}  // namespace etalon
