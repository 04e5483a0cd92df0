// /ws/video and /video.mjpg: the picture of any robot, encoded once for all viewers, with its true age. The
// newest picture wins. A page that cannot keep up is skipped until the next key frame, which is requested for
// it.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/channel_map.hpp"
#include "server/station/http/web_client.hpp"
#include "server/station/video/video_link.hpp"
#include "server/station/video/video_source.hpp"

namespace parhelion::station {

/// The cameras of a trainee's robot: channels on the bus.
struct RobotCamera {
  std::string robot, camera, original;
};

struct VideoOptions {
  std::string robot;                 ///< the trainee's
  std::string camera = "MR_CAMERA";  ///< channel of the augmented picture on the bus
  std::string original = "CAMERA";   ///< the camera's own channel, shown (and labelled) if `camera` delivers
                                     ///< nothing
  std::vector<RobotCamera> other_robots = {};  ///< of the other trainees
  bool simulated = false;                      ///< the trainee's robot is simulated
  /// The channel on the bus of an agent's camera.
  std::function<std::string(const std::string& agent)> agent_camera = agent_camera_channel;
  std::function<WallTime()> now;        ///< steady
  std::function<SensorTime()> stamp;    ///< wall clock
  std::function<SensorTime()> session;  ///< time of the playback; empty: the wall clock
  VideoLinkLimits limits = {};
};

/// Counts since the start.
struct VideoCounts {
  std::uint64_t pictures = 0;                    ///< received and requested by a viewer
  std::uint64_t refused = 0;                     ///< could not be decoded
  std::uint64_t coded = 0, keys = 0, bytes = 0;  ///< of H.264
  std::uint64_t sent = 0, left_out = 0;          ///< over all viewers
  double coding_s = 0;                           ///< total, for `pictures`
};

/// Thread-safe except turn(), which belongs to the thread of start() if that is used.
class VideoFeed {
 public:
  /// `bus`: an endpoint of its own, used only to receive.
  VideoFeed(std::unique_ptr<Bus> bus, VideoOptions options);
  ~VideoFeed();
  VideoFeed(const VideoFeed&) = delete;
  VideoFeed& operator=(const VideoFeed&) = delete;

  /// Query: `robot` (absent: the trainee's), `codec` "h264" or "jpeg". The feed must outlive its server.
  SocketHandler socket();
  /// A stream of JPEGs with media type `kStreamType`.
  static constexpr const char* kStreamType = "multipart/x-mixed-replace; boundary=frame";
  SocketHandler stream();
  /// Receives, encodes and sends in a thread of its own, at nice 10. Call once.
  void start();
  /// One round: waits at most `timeout` for a picture, and sends due pictures.
  void turn(Duration timeout);

  /// Robots that may have a camera: the trainee's and agents. `for_trainees`: those whose pictures trainees
  /// may see; of the others they learn nothing here.
  void set_robots(std::vector<std::string> robots, std::set<std::string> for_trainees = {});
  /// The faults camera_delay (s, 0..0.5) and camera_loss (fraction, 0..1).
  void impair(double delay, double loss);
  VideoCounts counts() const;

 private:
  struct Viewer;

  void opened(std::shared_ptr<WebClient> client, bool stream);
  void received(WebClient& client, std::string_view bytes, bool binary);
  void closed(WebClient& client);

  std::unique_ptr<VideoSource> make_source(const std::string& robot) const;
  bool is_for(const Viewer& viewer, const std::string& robot) const;
  bool is_known(const std::string& robot) const;
  void follow_viewers();
  Duration until_due(Duration timeout) const;
  void take(const Message& message);
  void show_due();
  VideoWanted wanted_of(VideoSource& source);
  void show(VideoSource& source, const VideoSource::Waiting& picture, const VideoWanted& wanted);
  void send(const VideoSource& source, VideoFrame frame, const CodedPicture& coded);
  void watch();

  const std::unique_ptr<Bus> bus_;
  const VideoOptions options_;
  mutable std::mutex mutex_;  // guards all members below
  std::vector<std::string> robots_;
  std::set<std::string> for_trainees_;
  std::map<std::uint64_t, std::unique_ptr<Viewer>> viewers_;     // by client
  std::map<std::string, std::unique_ptr<VideoSource>> sources_;  // by robot; each has a viewer
  double delay_ = 0, loss_ = 0;
  std::string bus_fault_;
  VideoCounts counts_;
  bool stop_ = false;
  std::condition_variable ended_;

  std::set<std::string> channels_;  // subscribed; used by the thread of turn()
  std::thread thread_;
};

}  // namespace parhelion::station
