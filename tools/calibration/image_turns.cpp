// The only file of the calibration that includes OpenCV.
#include "tools/calibration/image_turns.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "protocols/quantile.hpp"
#include "render/camera_model.hpp"
#include "render/jpeg.hpp"

namespace parhelion::tools {
namespace {

constexpr int kWidth = 640;        ///< px: larger images are halved until they are not wider
constexpr int kCorners = 120;      ///< at most
constexpr int kPatch = 7;          ///< px, half the side of a patch less a half
constexpr int kReach = 10;         ///< px, to where a corner is searched around its predicted place
constexpr double kSimilar = 0.85;  ///< correlation of a patch that was found again
constexpr std::size_t kMinCorners = 12;
constexpr Duration kMaxGap = milliseconds(500);

struct Sight {
  SensorTime stamp;
  cv::Mat gray;
};

/// A corner's azimuth in the first image, and by how much it moved, rad.
struct Shift {
  double azimuth = 0, moved = 0;
};

/// Moves of azimuths: a turn of the base is minus what they have in common; driving moves them to the sides,
/// by the sine of the azimuth over the distance. Robust least squares (Geman-McClure).
std::optional<double> common_turn(const std::vector<Shift>& shifts) {
  if (shifts.size() < kMinCorners) return std::nullopt;
  std::vector<double> sizes;
  for (const Shift& shift : shifts) sizes.push_back(shift.moved);
  double turn = median(sizes), sideways = 0;
  for (int i = 0; i < 10; ++i) {
    sizes.clear();
    for (const Shift& s : shifts) sizes.push_back(std::abs(s.moved - turn - sideways * std::sin(s.azimuth)));
    const double sigma = std::max(1.4826 * median(sizes), 2e-4);
    // Where azimuths are all alike, the prior keeps the two apart.
    double n = 0, x = 0, xx = std::pow(sigma / 0.2, 2), y = 0, xy = 0;
    std::size_t trusted = 0;
    for (const Shift& s : shifts) {
      const double e = (s.moved - turn - sideways * std::sin(s.azimuth)) / sigma;
      const double w = std::pow(9 / (9 + e * e), 2), along = std::sin(s.azimuth);
      n += w, x += w * along, xx += w * along * along, y += w * s.moved, xy += w * along * s.moved;
      if (w > 0.25) ++trusted;
    }
    const double determinant = n * xx - x * x;
    if (trusted < kMinCorners || !(determinant > 0)) return std::nullopt;
    turn = (xx * y - x * xy) / determinant;
    sideways = (n * xy - x * y) / determinant;
  }
  return -turn;
}

/// Place of the maximum between pixels, by a parabola each way.
cv::Point2d peak(const cv::Mat& scores, const cv::Point& at) {
  const auto refine = [](double before, double here, double after) {
    const double curve = before - 2 * here + after;
    return curve < 0 ? std::clamp(0.5 * (before - after) / curve, -0.5, 0.5) : 0.0;
  };
  const auto score = [&scores](int x, int y) { return double{scores.at<float>(y, x)}; };
  return {at.x + refine(score(at.x - 1, at.y), score(at.x, at.y), score(at.x + 1, at.y)),
          at.y + refine(score(at.x, at.y - 1), score(at.x, at.y), score(at.x, at.y + 1))};
}

/// Where the patch around `corner` is in `image`, near `expected`; nullopt: not similar, or at the border.
std::optional<cv::Point2d> found_again(const cv::Mat& before, const cv::Point2f& corner, const cv::Mat& image,
                                       const Eigen::Vector2d& expected) {
  const cv::Point centre(cvRound(corner.x), cvRound(corner.y));
  const cv::Point near(cvRound(expected.x()), cvRound(expected.y()));
  const cv::Rect whole(0, 0, image.cols, image.rows);
  const cv::Rect patch(centre.x - kPatch, centre.y - kPatch, 2 * kPatch + 1, 2 * kPatch + 1);
  const int reach = kReach + kPatch;
  const cv::Rect around(near.x - reach, near.y - reach, 2 * reach + 1, 2 * reach + 1);
  if ((patch & whole) != patch || (around & whole) != around) return std::nullopt;
  cv::Mat scores;
  cv::matchTemplate(image(around), before(patch), scores, cv::TM_CCOEFF_NORMED);
  double best = 0;
  cv::Point at;
  cv::minMaxLoc(scores, nullptr, &best, nullptr, &at);
  if (best < kSimilar || at.x == 0 || at.y == 0 || at.x == 2 * kReach || at.y == 2 * kReach)
    return std::nullopt;
  return peak(scores, at) + cv::Point2d(near.x - kReach, near.y - kReach) +
         cv::Point2d(double{corner.x} - centre.x, double{corner.y} - centre.y);
}

/// Shift of the middle of the image, px.
cv::Point2d coarse_shift(const cv::Mat& before, const cv::Mat& after) {
  constexpr int scale = 4;
  cv::Mat a, b, scores;
  cv::resize(before, a, {before.cols / scale, before.rows / scale}, 0, 0, cv::INTER_AREA);
  cv::resize(after, b, a.size(), 0, 0, cv::INTER_AREA);
  const cv::Rect middle(a.cols / 4, a.rows / 5, a.cols / 2, a.rows - 2 * (a.rows / 5));
  cv::matchTemplate(b, a(middle), scores, cv::TM_CCOEFF_NORMED);
  cv::Point at;
  cv::minMaxLoc(scores, nullptr, nullptr, nullptr, &at);
  return {double{scale} * (at.x - middle.x), double{scale} * (at.y - middle.y)};
}

}  // namespace

struct ImageTurns::State {
  State(const CameraDescription& description, const CameraIntrinsics& scaled)
      : camera(description), intrinsics(scaled), lens(scaled) {}

  CameraDescription camera;
  CameraIntrinsics intrinsics;  ///< of the images as they are compared
  render::Lens lens;
  render::JpegCodec codec;
  std::vector<std::uint8_t> bgr;
  std::optional<Sight> last;
  std::vector<pose::Turn> turns;
  ImageTurnCounts counts;

  cv::Mat decoded(const Image& image);
  std::optional<cv::Mat> gray(const Image& image);
  std::optional<Eigen::Vector3d> direction(const cv::Point2d& pixel) const;
  std::optional<double> turn(const cv::Mat& before, const cv::Mat& after) const;
};

/// 8 bits, one or three channels; empty where the image cannot be read.
cv::Mat ImageTurns::State::decoded(const Image& image) {
  if (image.format == PixelFormat::mjpeg) {
    const auto format = codec.decode(image.bytes, bgr);
    return format ? cv::Mat(format->height, format->width, CV_8UC3, bgr.data()) : cv::Mat();
  }
  const bool colour = image.format == PixelFormat::rgb || image.format == PixelFormat::bgr;
  if (!colour && image.format != PixelFormat::gray) return {};
  const int row = image.width * (colour ? 3 : 1), stride = image.row_stride > 0 ? image.row_stride : row;
  if (image.width <= 0 || image.height <= 0 || stride < row ||
      image.bytes.size() < static_cast<std::size_t>(stride) * static_cast<std::size_t>(image.height))
    return {};
  return cv::Mat(image.height, image.width, colour ? CV_8UC3 : CV_8UC1,
                 const_cast<std::uint8_t*>(image.bytes.data()), static_cast<std::size_t>(stride));
}

std::optional<cv::Mat> ImageTurns::State::gray(const Image& image) {
  cv::Mat pixels = decoded(image);
  if (pixels.empty() || pixels.cols * intrinsics.height != pixels.rows * intrinsics.width)
    return std::nullopt;
  // The order of the colours does not matter here.
  cv::Mat gray;
  if (pixels.channels() == 3) {
    cv::cvtColor(pixels, gray, cv::COLOR_BGR2GRAY);
  } else {
    gray = pixels.clone();
  }
  if (gray.cols != intrinsics.width)
    cv::resize(gray, gray, {intrinsics.width, intrinsics.height}, 0, 0, cv::INTER_AREA);
  return gray;
}

/// In base_link.
std::optional<Eigen::Vector3d> ImageTurns::State::direction(const cv::Point2d& pixel) const {
  const auto optical = lens.unproject({pixel.x, pixel.y});
  if (!optical) return std::nullopt;
  return camera.T_base_optical.quaternion() * *optical;
}

std::optional<double> ImageTurns::State::turn(const cv::Mat& before, const cv::Mat& after) const {
  constexpr double steep = 0.3;  // cosine of the elevation, below which an azimuth says little
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(before, corners, kCorners, 0.01, 10);
  const cv::Point2d middle(intrinsics.cx, intrinsics.cy);
  const auto ahead = direction(middle), then = direction(middle + coarse_shift(before, after));
  if (!ahead || !then) return std::nullopt;
  const Eigen::Quaterniond about =
      Eigen::Quaterniond::FromTwoVectors(*ahead, *then);  // as if all turned like the middle
  const Eigen::Quaterniond R_optical_base = camera.T_base_optical.quaternion().conjugate();
  std::vector<Shift> shifts;
  for (const cv::Point2f& corner : corners) {
    const auto a = direction({double{corner.x}, double{corner.y}});
    if (!a || a->head<2>().norm() < steep) continue;
    const auto expected = lens.project(R_optical_base * (about * *a));
    if (!expected) continue;
    const auto place = found_again(before, corner, after, *expected);
    const auto b = place ? direction(*place) : std::nullopt;
    if (!b || b->head<2>().norm() < steep) continue;
    const double azimuth = std::atan2(a->y(), a->x());
    shifts.push_back({azimuth, wrap_angle(std::atan2(b->y(), b->x()) - azimuth)});
  }
  return common_turn(shifts);
}

ImageTurns::ImageTurns(std::unique_ptr<State> state) : state_(std::move(state)) {}
ImageTurns::ImageTurns(ImageTurns&&) noexcept = default;
ImageTurns& ImageTurns::operator=(ImageTurns&&) noexcept = default;
ImageTurns::~ImageTurns() = default;
const std::vector<pose::Turn>& ImageTurns::turns() const { return state_->turns; }
const ImageTurnCounts& ImageTurns::counts() const { return state_->counts; }

Result<ImageTurns> ImageTurns::create(const CameraDescription& camera) {
  if (!camera.head.empty()) return Error{"the camera is carried by joints and turns by itself"};
  int width = camera.intrinsics.width, height = camera.intrinsics.height;
  while (width > kWidth && width % 2 == 0 && height % 2 == 0) width /= 2, height /= 2;
  auto scaled = render::intrinsics_for_size(camera.intrinsics, width, height);
  if (!scaled) return scaled.error();
  return ImageTurns(std::make_unique<State>(camera, *scaled));
}

void ImageTurns::add(const Image& image) {
  State& state = *state_;
  ++state.counts.images;
  auto gray = state.gray(image);
  if (!gray) {
    ++state.counts.refused;
    return;
  }
  if (state.last && image.stamp <= state.last->stamp) {
    ++state.counts.refused;
    return;
  }
  if (state.last && image.stamp - state.last->stamp <= kMaxGap) {
    if (const auto turn = state.turn(state.last->gray, *gray)) {
      state.turns.push_back({state.last->stamp, image.stamp, *turn});
    } else {
      ++state.counts.unmatched;
    }
  }
  state.last = Sight{image.stamp, std::move(*gray)};
}

}  // namespace parhelion::tools
