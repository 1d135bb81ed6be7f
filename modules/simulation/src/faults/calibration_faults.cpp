#include "calibration_faults.h"

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "fault_list.h"

namespace etalon {

namespace {

/** The rig turned about the left camera's centre, or one camera about its own. */
void turn(Lens lens, const Eigen::Matrix3d& R, StereoInertialCalibration* calibration) {
  SE3& left = calibration->cameras[0].T_BC;
  SE3& right = calibration->cameras[1].T_BC;
  const SE3 T_LR = left.inverse() * right;
  if (lens != Lens::kRight) left.R = left.R * R;
  if (lens == Lens::kBoth) right = left * T_LR;
  if (lens == Lens::kRight) right.R = right.R * R;
}

void lengthen(double percent, CameraModel* model) {
  for (const char* name : {"fu", "fv"})
    *model = model->with(name, model->parameter(name) * (1.0 + 1e-2 * percent));
}

}  // namespace

StereoInertialCalibration faultyCalibration(StereoInertialCalibration calibration,
                                            const std::vector<Fault>& faults, std::uint64_t seed) {
  using Wrong = faults::WrongCalibration;
  forEachFault<Wrong>(faults, [&](const Wrong& fault, size_t i) {
    CameraCalibration& left = calibration.cameras[0];
    CameraCalibration& right = calibration.cameras[1];
    const Eigen::Vector3d axis = faultRandom(seed, i, 0).direction();
    turn(fault.lens, expSO3(radians(fault.rotation_deg) * axis), &calibration);
    if (fault.baseline_percent != 0.0)
      right.T_BC.t =
          left.T_BC.t + (right.T_BC.t - left.T_BC.t) * (1.0 + 1e-2 * fault.baseline_percent);
    if (fault.focal_percent == 0.0) return;
    if (fault.lens != Lens::kRight) lengthen(fault.focal_percent, &left.model);
    if (fault.lens != Lens::kLeft) lengthen(fault.focal_percent, &right.model);
  });
  return calibration;
}

}  // namespace etalon
