#pragma once

#include <Eigen/Core>
#include <vector>

namespace etalon::ground_truth {

/**
 * Low pass with the response 1 / (1 + (f / bandwidth)^4), no phase: a Butterworth filter of second
 * order forward and backward, by the bilinear transform without prewarping, so that a bandwidth far
 * above the sampling passes everything. It is the response with which a smoother of white positions
 * and white accelerations follows the positions, and one less it the response to the accelerations.
 * @param signal a column a sample
 * @param begins first samples of the stretches that are filtered by themselves; the first is 0
 */
Eigen::MatrixXd lowPassed(Eigen::MatrixXd signal, const std::vector<Eigen::Index>& begins,
                          double step_s, double bandwidth_hz, int order);

}  // namespace etalon::ground_truth
