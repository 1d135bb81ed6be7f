#include "gui/flight_window.h"

#include <mrpt/gui/CDisplayWindow3D.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <thread>

#include "etalon/report/scene.h"

namespace etalon::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBetweenDrawings{100};
/** A long flight has many landmarks and keyframes, so they are collected only once a second. */
constexpr std::chrono::milliseconds kBetweenMaps{1000};
constexpr int kWidth = 1200, kHeight = 800;  // px, of the window as it opens
constexpr double kImageWidth = 0.38;         ///< of the window's width

/** Draws landmarks that both cameras see green, those of the left one alone amber. */
cv::Mat drawn(const FrontFrame& frame) {
  cv::Mat image;
  cv::cvtColor(frame.images.left, image, cv::COLOR_GRAY2BGR);
  if (!frame.tracked) return image;
  for (const Observation& o : frame.tracked->observations)
    cv::circle(image, cv::Point2d(o.left.x(), o.left.y()), 3,
               o.has_right ? cv::Scalar(60, 220, 60) : cv::Scalar(0, 170, 255), 1, cv::LINE_AA);
  return image;
}

class MrptFlightWindow : public FlightWindow {
 public:
  explicit MrptFlightWindow(Pipeline* pipeline)
      : pipeline_(*pipeline), window_("Etalon", kWidth, kHeight) {
    if (!window_.isOpen())
      std::fprintf(stderr, "warning: --gui: the window did not open; the run goes on without it\n");
    window_.setCameraZoom(8.0F);
    window_.setCameraElevationDeg(45.0F);
    window_.setCameraAzimuthDeg(-60.0F);
    pipeline_.onTracks([this](const FrontFrame& frame) {
      if (!frame.images.left.empty()) last_ = frame;
    });
  }

  ~MrptFlightWindow() override { pipeline_.onTracks(nullptr); }

  void update() override {
    const auto now = Clock::now();
    if (now - drawn_at_ < kBetweenDrawings) return;
    drawn_at_ = now;
    const bool with_map = now - map_at_ >= kBetweenMaps;
    if (with_map) map_at_ = now;
    draw(with_map);
  }

  void waitUntilClosed(const std::atomic<bool>& stop) override {
    draw(true);
    if (!window_.isOpen()) return;
    std::printf("replay: close the window, or press Ctrl-C, to end\n");
    std::fflush(stdout);
    while (window_.isOpen() && !stop) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }

 private:
  void draw(bool with_map) {
    if (!window_.isOpen()) return;
    flight_.trajectory = pipeline_.trajectory();
    if (with_map) {
      flight_.keyframes = pipeline_.record().smoothed();
      flight_.landmarks = pipeline_.record().landmarks();
    }
    mrpt::opengl::COpenGLScene::Ptr scene = sceneOf(flight_);
    if (last_) {
      const cv::Mat image = drawn(*last_);
      auto view = scene->createViewport("left image");
      const double height = kImageWidth * kWidth / kHeight * image.rows / image.cols;
      view->setViewportPosition(0.0, 1.0 - height, kImageWidth, height);
      view->setImageView(mrpt::img::CImage(image, mrpt::img::DEEP_COPY));
    }
    window_.get3DSceneAndLock() = scene;
    mrpt::opengl::TFontParams font;
    font.color = {0.0F, 0.0F, 0.0F};
    window_.addTextMessage(0.01, 0.02, text(), 0, font);
    window_.unlockAccess3DScene();
    if (!flight_.trajectory.empty()) {
      const Eigen::Vector3f p = flight_.trajectory.back().T_WB.t.cast<float>();
      window_.setCameraPointingToPoint(p.x(), p.y(), p.z());
    }
    window_.forceRepaint();
  }

  std::string text() const {
    char line[128];
    const double seconds = flight_.trajectory.empty() ? 0.0
                                                      : secondsBetween(flight_.trajectory.front().t,
                                                                       flight_.trajectory.back().t);
    std::snprintf(line, sizeof line, "%.1f s  %s  %zu landmarks", seconds,
                  toString(pipeline_.state()), flight_.landmarks.size());
    return line;
  }

  Pipeline& pipeline_;
  mrpt::gui::CDisplayWindow3D window_;
  std::optional<FrontFrame> last_;
  FlightScene flight_;
  Clock::time_point drawn_at_, map_at_;
};

}  // namespace
}  // namespace etalon::app

extern "C" etalon::app::FlightWindow* etalon_make_flight_window(etalon::Pipeline* pipeline) {
  // MRPT gives up after seconds without a word from its constructor; a machine under load needs more.
  setenv("MRPT_WXSUBSYS_TIMEOUT_MS", "60000", 0);
  return new etalon::app::MrptFlightWindow(pipeline);
}
