#pragma once

#include <mrpt/opengl/COpenGLScene.h>

#include <map>
#include <string>

#include "etalon/core/tracked_frame.h"
#include "etalon/core/trajectory.h"

namespace etalon {

/** The parts of a flight's 3-D scene, all in W. */
struct FlightScene {
  Trajectory trajectory;                            ///< T_WB of all frames: a line
  Trajectory keyframes;                             ///< T_WB: axes
  std::map<LandmarkId, Eigen::Vector3d> landmarks;  ///< p_W, m: points
  Trajectory ground_truth;  ///< a line of another colour, as given; may be empty
};

/**
 * The flight as a scene of MRPT, with a grid at its lowest point.
 * Landmarks farther than 100 m from the flight's middle are left out.
 */
mrpt::opengl::COpenGLScene::Ptr sceneOf(const FlightScene& flight);

/**
 * Writes sceneOf() to a file that MRPT's SceneViewer3D opens. Needs no display.
 * @throws DataError if the file cannot be written
 */
void writeScene(const std::string& path, const FlightScene& flight);

}  // namespace etalon
