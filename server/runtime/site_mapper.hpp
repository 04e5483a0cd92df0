// The thread that updates the model from the robot's views, parallel to the tick and at lower priority.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "fusion/cloud/sensor_cloud.hpp"
#include "protocols/image.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/model_path.hpp"

namespace parhelion::runtime {

/// A depth image with the pose of its camera.
struct PlacedDepth {
  Image depth;
  DepthCameraDescription camera;
  Transform<Map, DepthOptical> T_map_optical;  ///< at the image's stamp, from the pose track
};

/// Scan lines of a laser that moved over the site, ordered by time; at least one.
struct LineView {
  std::vector<cloud::PlacedLine> lines;
  LaserDescription laser;
  cloud::OwnBody body;
};

/// One view of the site.
using SiteView = std::variant<PlacedDepth, LineView>;
/// Of the image, or of the last line.
SensorTime stamp_of(const SiteView& view);

/// Rebuilds the model with one more view; nullopt: the view changes nothing. Called only on the mapper's
/// thread. Error: why the view was left out.
using UpdateSite = std::function<Result<std::optional<SemanticModel>>(const SiteView&)>;

class SiteMapper {
 public:
  struct Ready {
    ModelVersion message;          ///< to be logged as an input
    tick::PreparedModel prepared;  ///< for the tick
    Duration latency;              ///< from submit() to the result, measured
  };
  struct Counts {
    std::uint64_t views = 0, models = 0;
    std::uint64_t dropped = 0;  ///< views replaced by newer ones
    std::uint64_t refused = 0;  ///< views that could not be used
    std::string last_refusal;
  };

  /// `nice`: the thread's niceness relative to the tick. `configuration` must outlive this.
  SiteMapper(UpdateSite update, const tick::Configuration& configuration, int nice);
  ~SiteMapper();

  /// Never blocks. The newest view is used first; when the queue is full the oldest is dropped.
  void submit(SiteView view);
  /// The oldest model not yet taken.
  std::optional<Ready> take();
  Counts counts() const;

 private:
  static constexpr std::size_t kCapacity = 4;
  struct Waiting {
    SiteView view;
    WallTime since;
  };
  void run(int nice);
  Result<std::optional<Ready>> make(const SiteView& view, std::uint64_t version) const;

  UpdateSite update_;
  const tick::Configuration& configuration_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> waiting_;  // oldest first
  std::deque<Ready> ready_;
  Counts counts_;
  bool stop_ = false;
  std::thread thread_;
};

/// For the report: "12 views, 9 models, 2 dropped, 1 refused (no overlap)".
std::string to_text(const SiteMapper::Counts& counts);

}  // namespace parhelion::runtime
