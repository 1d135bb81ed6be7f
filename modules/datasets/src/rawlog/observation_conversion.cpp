#include "etalon/datasets/observation_conversion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/datasets/mrpt_time.h"
#include "image_file.h"

namespace etalon {

namespace {

namespace obs = mrpt::obs;

/** Indices of MRPT's IMU array in the order of ImuSample. */
constexpr std::array<obs::TIMUDataIndex, 3> kGyro = {obs::IMU_WX, obs::IMU_WY, obs::IMU_WZ};
constexpr std::array<obs::TIMUDataIndex, 3> kAccel = {obs::IMU_X_ACC, obs::IMU_Y_ACC,
                                                      obs::IMU_Z_ACC};

mrpt::poses::CPose3DQuat toMrptPoseQuat(const SE3& T) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(T.R).normalized();
  return {T.t.x(), T.t.y(), T.t.z(), mrpt::math::CQuaternionDouble(q.w(), q.x(), q.y(), q.z())};
}

SE3 fromMrptPoseQuat(const mrpt::poses::CPose3DQuat& pose) {
  const auto& q = pose.quat();
  return {Eigen::Quaterniond(q.r(), q.x(), q.y(), q.z()).normalized().toRotationMatrix(),
          Eigen::Vector3d(pose.x(), pose.y(), pose.z())};
}

/** MRPT's distortion of the same equations, and the places of our coefficients in its array; those of
 * a kind with fewer coefficients come first. */
struct MrptDistortion {
  const char* name;
  mrpt::img::DistortionModel mrpt;
  std::array<size_t, 5> places;
};
constexpr std::array<MrptDistortion, 3> kMrptDistortions = {
    {{"radial-tangential", mrpt::img::DistortionModel::plumb_bob, {0, 1, 2, 3}},
     {"radial-tangential-k3", mrpt::img::DistortionModel::plumb_bob, {0, 1, 2, 3, 4}},
     {"equidistant", mrpt::img::DistortionModel::kannala_brandt, {0, 1, 4, 5}}}};

mrpt::img::TCamera toMrptCamera(const CameraModel& model, const std::string& name) {
  mrpt::img::TCamera camera;
  camera.cameraName = name;
  camera.ncols = static_cast<uint32_t>(model.width());
  camera.nrows = static_cast<uint32_t>(model.height());
  camera.setIntrinsicParamsFromValues(model.focal().x(), model.focal().y(),
                                      model.principalPoint().x(), model.principalPoint().y());
  const std::vector<double>& d = model.coefficients();
  for (const MrptDistortion& distortion : kMrptDistortions)
    if (model.kind() && model.kind()->distortion.front() == distortion.name) {
      camera.distortion = distortion.mrpt;
      for (size_t i = 0; i < d.size(); ++i) camera.dist[distortion.places[i]] = d[i];
    }
  return camera;
}

CameraModel fromMrptCamera(const mrpt::img::TCamera& camera, const std::string& name) {
  if (!(camera.fx() > 0) || !(camera.fy() > 0))
    throw DataError(name, 0, "the intrinsic parameters are missing; expected positive fx and fy");
  std::string distortion = "none";
  std::vector<double> coefficients;
  bool complete = true;  // no coefficient is left over
  for (const MrptDistortion& known : kMrptDistortions) {
    if (camera.distortion != known.mrpt) continue;
    distortion = known.name;
    coefficients.clear();
    auto rest = camera.dist;
    const size_t count = findCameraKind("pinhole", known.name)->coefficients.size();
    for (size_t i = 0; i < count; ++i)
      coefficients.push_back(std::exchange(rest[known.places[i]], 0.0));
    complete = std::all_of(rest.begin(), rest.end(), [](double d) { return d == 0.0; });
    if (complete) break;
  }
  if (!complete)
    throw DataError(name, 0,
                    "the distortion is not supported; supported is 'plumb_bob' with k1, k2, p1, "
                    "p2, k3 and 'kannala_brandt' with k1, k2, k3, k4");
  try {
    return CameraModel("pinhole", distortion, static_cast<int>(camera.ncols),
                       static_cast<int>(camera.nrows),
                       {camera.fx(), camera.fy(), camera.cx(), camera.cy()}, coefficients);
  } catch (const ConfigError& e) {
    throw DataError(name, 0, e.what());
  }
}

mrpt::img::CImage toMrptImage(const cv::Mat& image, const std::string& path, bool external) {
  mrpt::img::CImage converted;
  if (external && !path.empty()) {
    converted.setExternalStorage(path);
    return converted;
  }
  // CImage stores a non-contiguous matrix such that it cannot be read back.
  return {image.isContinuous() ? image : image.clone(), mrpt::img::SHALLOW_COPY};
}

}  // namespace

cv::Mat toGrayImage(const mrpt::img::CImage& image, const std::string& base_folder,
                    std::string* path, const std::string& name) {
  if (image.isExternallyStored()) {
    *path = base_folder.empty()
                ? image.getExternalStorageFileAbsolutePath()
                : (std::filesystem::path(base_folder) / image.getExternalStorageFile()).string();
    std::string problem;
    cv::Mat gray = readGrayImage(*path, &problem);
    if (!problem.empty()) throw DataError(*path, 0, problem);
    return gray;
  }
  if (image.isEmpty()) throw DataError(name, 0, "expected images, found an empty one");
  const cv::Mat& pixels = image.asCvMatRef();
  if (pixels.depth() != CV_8U) throw DataError(name, 0, "expected images of 8 bits");
  if (pixels.channels() == 1) return pixels;
  cv::Mat gray;
  cv::cvtColor(pixels, gray, pixels.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
  return gray;
}

mrpt::poses::CPose3D toMrptPose(const SE3& T) { return mrpt::poses::CPose3D(toMrptPoseQuat(T)); }

SE3 fromMrptPose(const mrpt::poses::CPose3D& pose) {
  mrpt::math::CMatrixDouble33 R;
  pose.getRotationMatrix(R);
  SE3 T;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) T.R(r, c) = R(r, c);
  T.R = nearestRotation(T.R);
  T.t = {pose.x(), pose.y(), pose.z()};
  return T;
}

obs::CObservationStereoImages toObservation(const StereoFrame& frame,
                                            const StereoInertialCalibration& calibration,
                                            bool external) {
  obs::CObservationStereoImages observation;
  observation.timestamp = toMrptTime(frame.t);
  observation.sensorLabel = kStereoLabel;
  observation.hasImageRight = true;
  observation.imageLeft = toMrptImage(frame.left, frame.left_path, external);
  observation.imageRight = toMrptImage(frame.right, frame.right_path, external);
  observation.leftCamera = toMrptCamera(calibration.cameras[0].model, "cam0");
  observation.rightCamera = toMrptCamera(calibration.cameras[1].model, "cam1");
  observation.cameraPose = toMrptPoseQuat(calibration.cameras[0].T_BC);
  observation.rightCameraPose = toMrptPoseQuat(calibration.rightFromLeft().inverse());
  return observation;
}

obs::CObservationIMU toObservation(const ImuSample& sample) {
  obs::CObservationIMU observation;
  observation.timestamp = toMrptTime(sample.t);
  observation.sensorLabel = kImuLabel;
  for (size_t i = 0; i < 3; ++i) {
    observation.set(kGyro[i], sample.gyro[i]);
    observation.set(kAccel[i], sample.accel[i]);
  }
  return observation;
}

/** d(yaw, pitch, roll) / d(rotation vector in the body), R = Rz(yaw) Ry(pitch) Rx(roll). */
static Eigen::Matrix3d anglesByRotation(double pitch, double roll) {
  // The body's rate is E (yaw, pitch, roll)'; near a pitch of 90 deg the angles know no covariance.
  Eigen::Matrix3d E;
  E << -std::sin(pitch), 0.0, 1.0,                            //
      std::cos(pitch) * std::sin(roll), std::cos(roll), 0.0,  //
      std::cos(pitch) * std::cos(roll), -std::sin(roll), 0.0;
  return E.inverse();
}

obs::CObservationRobotPose toObservation(const StampedPose& pose, const std::string& label,
                                         const Eigen::Matrix<double, 6, 6>& covariance) {
  obs::CObservationRobotPose observation;
  observation.timestamp = toMrptTime(pose.t);
  observation.sensorLabel = label;
  observation.pose.mean = toMrptPose(pose.T_WB);
  observation.pose.cov.setZero();
  if (covariance.isZero()) return observation;
  if (!covariance.allFinite()) {  // zero would say that the pose is exact
    constexpr double kFarM = 1e3, kAnyAngleRad = M_PI;
    observation.pose.cov.asEigen().diagonal() << Eigen::Vector3d::Constant(kFarM * kFarM),
        Eigen::Vector3d::Constant(kAnyAngleRad * kAnyAngleRad);
    return observation;
  }
  const mrpt::poses::CPose3D& mean = observation.pose.mean;
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Zero();
  J.topRightCorner<3, 3>().setIdentity();
  J.bottomLeftCorner<3, 3>() = anglesByRotation(mean.pitch(), mean.roll());
  observation.pose.cov = Eigen::Matrix<double, 6, 6>(J * covariance * J.transpose());
  return observation;
}

StereoFrame toStereoFrame(const obs::CObservationStereoImages& observation,
                          const std::string& base_folder) {
  const std::string name = "stereo observation '" + observation.sensorLabel + "'";
  if (!observation.hasImageRight)
    throw DataError(name, 0, "expected a right image beside the left one");
  StereoFrame frame;
  frame.t = fromMrptTime(observation.timestamp);
  frame.left = toGrayImage(observation.imageLeft, base_folder, &frame.left_path, name);
  frame.right = toGrayImage(observation.imageRight, base_folder, &frame.right_path, name);
  return frame;
}

std::optional<ImuSample> toImuSample(const obs::CObservationIMU& observation) {
  ImuSample sample;
  sample.t = fromMrptTime(observation.timestamp);
  for (size_t i = 0; i < 3; ++i) {
    if (!observation.has(kGyro[i]) || !observation.has(kAccel[i])) return std::nullopt;
    sample.gyro[i] = observation.get(kGyro[i]);
    sample.accel[i] = observation.get(kAccel[i]);
  }
  return sample;
}

StereoInertialCalibration calibrationOf(const obs::CObservationStereoImages& observation,
                                        const SE3& T_RB, const std::string& name) {
  StereoInertialCalibration calibration;
  calibration.cameras[0].model = fromMrptCamera(observation.leftCamera, name + ", left camera");
  calibration.cameras[1].model = fromMrptCamera(observation.rightCamera, name + ", right camera");
  const SE3 T_C0C1 = fromMrptPoseQuat(observation.rightCameraPose);
  if (T_C0C1.t.norm() < 1e-6)
    throw DataError(name, 0,
                    "the right camera's pose on the left one is missing; expected a baseline");
  calibration.cameras[0].T_BC = T_RB.inverse() * fromMrptPoseQuat(observation.cameraPose);
  calibration.cameras[1].T_BC = calibration.cameras[0].T_BC * T_C0C1;
  return calibration;
}

}  // namespace etalon
