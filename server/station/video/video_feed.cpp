#include "server/station/video/video_feed.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "protocols/codec.hpp"
#include "server/runtime/thread_priority.hpp"
#include "server/station/http/http_message.hpp"

namespace parhelion::station {
namespace {

constexpr Duration kKeyPeriod = milliseconds(300);  // key frames are large and sent to everybody
constexpr std::size_t kMaxWaiting = 64;             // pictures delayed by a fault
constexpr int kMaxFaults = 20;                      // of one page before it is closed
constexpr int kNewestWins = 0;                      // slot of pictures that may all be dropped
constexpr int kNice = 10;
constexpr const char* kBoundary = "\r\n--frame\r\n";

/// Ends with the boundary: a browser shows a part only at the boundary after it, which would cost one picture
/// of delay.
std::shared_ptr<const std::string> stream_part(const std::vector<std::uint8_t>& jpeg) {
  auto part = std::make_shared<std::string>(
      "Content-Type: image/jpeg\r\nContent-Length: " + std::to_string(jpeg.size()) + "\r\n\r\n");
  part->append(jpeg.begin(), jpeg.end());
  part->append(kBoundary);
  return part;
}

}  // namespace

struct VideoFeed::Viewer {
  std::shared_ptr<WebClient> client;
  std::string robot;
  VideoCodec codec = VideoCodec::jpeg;
  bool stream = false;
  VideoLink link;
  bool needs_key = true, ready = false;
  VideoStatus sent_status;
  bool status_sent = false;
  int faults = 0;
};

VideoFeed::VideoFeed(std::unique_ptr<Bus> bus, VideoOptions options)
    : bus_(std::move(bus)), options_(std::move(options)), robots_{options_.robot} {}

VideoFeed::~VideoFeed() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  ended_.notify_all();
  if (thread_.joinable()) thread_.join();
}

SocketHandler VideoFeed::socket() {
  return {[this](std::shared_ptr<WebClient> client) { opened(std::move(client), false); },
          [this](WebClient& client, std::string_view bytes, bool binary) { received(client, bytes, binary); },
          [this](WebClient& client) { closed(client); }};
}

SocketHandler VideoFeed::stream() {
  SocketHandler handler = socket();
  handler.opened = [this](std::shared_ptr<WebClient> client) { opened(std::move(client), true); };
  return handler;
}

void VideoFeed::opened(std::shared_ptr<WebClient> client, bool stream) {
  auto viewer = std::make_unique<Viewer>();
  viewer->robot = query_value(client->query(), "robot").value_or(options_.robot);
  if (!stream && query_value(client->query(), "codec") == "h264") viewer->codec = VideoCodec::h264;
  viewer->stream = stream;
  viewer->link = VideoLink(options_.limits);
  viewer->client = std::move(client);
  if (stream) viewer->client->send(std::make_shared<const std::string>(kBoundary), true);
  const std::lock_guard lock(mutex_);
  viewers_[viewer->client->id()] = std::move(viewer);
}

void VideoFeed::closed(WebClient& client) {
  const std::lock_guard lock(mutex_);
  viewers_.erase(client.id());
}

void VideoFeed::received(WebClient& client, std::string_view bytes, bool binary) {
  const auto request =
      binary ? Result<VideoRequest>(Error{"expected text, not binary"}) : read_video_request(bytes);
  const std::lock_guard lock(mutex_);
  const auto found = viewers_.find(client.id());
  if (found == viewers_.end()) return;
  Viewer& viewer = *found->second;
  if (!request) {
    if (++viewer.faults >= kMaxFaults) client.close(1008, request.error().message);
    return;
  }
  switch (request->kind) {
    case VideoRequest::Kind::ack:
      return viewer.link.acknowledged(request->sequence, options_.now());
    case VideoRequest::Kind::key:
      viewer.needs_key = true;
      return;
    case VideoRequest::Kind::clock:
      return client.send(
          std::make_shared<const std::string>(clock_text(request->at_ms, options_.stamp().utime())), false);
  }
}

bool VideoFeed::is_for(const Viewer& viewer, const std::string& robot) const {
  if (viewer.client->who().role != Role::trainee || robot == options_.robot) return true;
  const auto& others = options_.other_robots;
  return for_trainees_.contains(robot) ||
         std::any_of(others.begin(), others.end(),
                     [&](const RobotCamera& other) { return other.robot == robot; });
}

bool VideoFeed::is_known(const std::string& robot) const {
  return std::find(robots_.begin(), robots_.end(), robot) != robots_.end();
}

void VideoFeed::set_robots(std::vector<std::string> robots, std::set<std::string> for_trainees) {
  const std::lock_guard lock(mutex_);
  robots_ = std::move(robots);
  for_trainees_ = std::move(for_trainees);
  if (std::find(robots_.begin(), robots_.end(), options_.robot) == robots_.end())
    robots_.insert(robots_.begin(), options_.robot);
}

void VideoFeed::impair(double delay, double loss) {
  const std::lock_guard lock(mutex_);
  delay_ = std::clamp(delay, 0.0, 0.5);
  loss_ = std::clamp(loss, 0.0, 1.0);
}

VideoCounts VideoFeed::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void VideoFeed::start() {
  thread_ = std::thread([this] {
    runtime::lower_priority(kNice);
    while (true) {
      turn(milliseconds(100));
      std::unique_lock lock(mutex_);
      // A failing bus returns at once: retry ten times a second.
      if (!bus_fault_.empty())
        ended_.wait_for(lock, std::chrono::milliseconds(100), [this] { return stop_; });
      if (stop_) return;
    }
  });
}

void VideoFeed::turn(Duration timeout) {
  follow_viewers();
  Message message;
  const auto came = bus_->receive(message, until_due(timeout));
  {
    const std::lock_guard lock(mutex_);
    bus_fault_ = came ? "" : came.error().message;
  }
  if (came && *came) take(message);
  show_due();
  watch();
}

std::unique_ptr<VideoSource> VideoFeed::make_source(const std::string& robot) const {
  if (robot == options_.robot)
    return std::make_unique<VideoSource>(robot, options_.camera, options_.original, options_.simulated);
  for (const RobotCamera& other : options_.other_robots) {
    if (other.robot == robot)
      return std::make_unique<VideoSource>(robot, other.camera, other.original, false);
  }
  return std::make_unique<VideoSource>(robot, options_.agent_camera(robot), "", true);
}

void VideoFeed::follow_viewers() {
  std::set<std::string> wanted;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, viewer] : viewers_) {
      if (!is_known(viewer->robot) || !is_for(*viewer, viewer->robot) || sources_.count(viewer->robot) != 0)
        continue;
      sources_[viewer->robot] = make_source(viewer->robot);
    }
    std::erase_if(sources_, [&](const auto& each) {
      return std::none_of(viewers_.begin(), viewers_.end(),
                          [&](const auto& viewer) { return viewer.second->robot == each.first; });
    });
    for (const auto& [robot, source] : sources_) {
      for (const std::string& channel : {source->channel(), source->original_channel()}) {
        if (!channel.empty()) wanted.insert(channel);
      }
    }
  }
  for (const std::string& channel : wanted) {
    if (channels_.insert(channel).second) static_cast<void>(bus_->subscribe(channel, 1));
  }
}

Duration VideoFeed::until_due(Duration timeout) const {
  const std::lock_guard lock(mutex_);
  const WallTime now = options_.now();
  for (const auto& [robot, source] : sources_) {
    if (!source->waiting.empty()) timeout = std::min(timeout, source->waiting.front().due - now);
  }
  return std::max(timeout, Duration{});
}

void VideoFeed::take(const Message& message) {
  const std::lock_guard lock(mutex_);
  const WallTime now = options_.now();
  for (auto& [robot, source] : sources_) {
    if (!source->accepts(message.channel, now)) continue;
    VideoSource::Waiting picture;
    picture.original = message.channel != source->channel();
    picture.due = now + seconds(delay_);
    picture.arrived = message.arrival;
    if (Status read = decode(message.channel, message.payload, picture.image); !read) {
      source->fault = read.error().message;
      ++counts_.refused;
      continue;
    }
    if (source->is_lost(loss_)) continue;
    source->waiting.push_back(std::move(picture));
    if (source->waiting.size() > kMaxWaiting) source->waiting.pop_front();
  }
}

void VideoFeed::show_due() {
  std::vector<std::string> robots;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [robot, source] : sources_) robots.push_back(robot);
  }
  for (const std::string& robot : robots) {
    std::unique_lock lock(mutex_);
    VideoSource& source = *sources_.at(robot);  // only this thread adds and erases
    auto picture = source.take_due(options_.now());
    if (!picture) continue;
    const VideoWanted wanted = wanted_of(source);
    lock.unlock();
    if (wanted.h264 || wanted.jpeg) show(source, *picture, wanted);
  }
}

VideoWanted VideoFeed::wanted_of(VideoSource& source) {
  VideoWanted wanted;
  const WallTime now = options_.now();
  const bool key_is_due = !source.keyed || now - *source.keyed >= kKeyPeriod;
  wanted.bit_rate = options_.limits.ceiling;
  for (auto& [id, viewer] : viewers_) {
    if (viewer->robot != source.robot() || !is_for(*viewer, source.robot())) continue;
    viewer->link.look(viewer->client->waiting_bytes(), now);
    if (viewer->codec == VideoCodec::jpeg) {
      viewer->ready = !viewer->link.congested();
      wanted.jpeg = wanted.jpeg || viewer->ready;
      continue;
    }
    viewer->ready = !viewer->link.lags();
    if (!viewer->ready) viewer->needs_key = true;
    wanted.h264 = true;
    wanted.key = wanted.key || (viewer->ready && viewer->needs_key && key_is_due);
    wanted.bit_rate = std::min(wanted.bit_rate, viewer->link.bit_rate());
  }
  return wanted;
}

void VideoFeed::show(VideoSource& source, const VideoSource::Waiting& picture, const VideoWanted& wanted) {
  const WallTime begun = options_.now();
  const auto coded = source.coder.code(picture.image, wanted);
  const WallTime now = options_.now();
  const std::lock_guard lock(mutex_);
  ++counts_.pictures;
  counts_.coding_s += (now - begun).seconds();
  if (!coded) {
    source.fault = coded.error().message;
    ++counts_.refused;
    return;
  }
  const SensorTime wall = options_.stamp();
  VideoFrame frame = source.shown(picture, options_.session ? options_.session() : wall, wall, now);
  frame.width = coded->width;
  frame.height = coded->height;
  if (coded->key) source.keyed = now;
  counts_.coded += !coded->h264.empty();
  counts_.keys += coded->key;
  counts_.bytes += coded->h264.size();
  send(source, frame, *coded);
}

void VideoFeed::send(const VideoSource& source, VideoFrame frame, const CodedPicture& coded) {
  const WallTime now = options_.now();
  std::shared_ptr<const std::string> as_h264, as_jpeg, part;
  if (!coded.h264.empty()) {
    frame.codec = VideoCodec::h264;
    frame.key = coded.key;
    as_h264 = video_message(frame, coded.h264);
  }
  if (!coded.jpeg.empty()) {
    frame.codec = VideoCodec::jpeg;
    frame.key = true;
    as_jpeg = video_message(frame, coded.jpeg);
  }
  for (auto& [id, viewer] : viewers_) {
    if (viewer->robot != source.robot() || !is_for(*viewer, source.robot())) continue;
    const bool h264 = viewer->codec == VideoCodec::h264 && as_h264 != nullptr;
    const bool follows = viewer->ready && (!h264 || coded.key || !viewer->needs_key);
    if (!follows || (!h264 && as_jpeg == nullptr)) {
      ++counts_.left_out;
      continue;
    }
    if (viewer->stream) {
      if (!part) part = stream_part(coded.jpeg);
      viewer->client->send(part, true, kNewestWins);
    } else {
      viewer->client->send(h264 ? as_h264 : as_jpeg, true, h264 ? WebClient::kInOrder : kNewestWins);
    }
    if (h264) viewer->needs_key = false;
    viewer->link.sent(frame.sequence, now);
    ++counts_.sent;
  }
}

void VideoFeed::watch() {
  const std::lock_guard lock(mutex_);
  const WallTime now = options_.now();
  for (auto& [id, viewer] : viewers_) {
    if (viewer->stream) continue;
    const auto source = is_for(*viewer, viewer->robot) ? sources_.find(viewer->robot) : sources_.end();
    VideoStatus status;
    if (source != sources_.end()) {
      status = source->second->status(now);
    } else if (is_known(viewer->robot) && is_for(*viewer, viewer->robot)) {
      continue;  // it connected after follow_viewers(): the next turn makes its source
    } else {
      status.why = "there is no robot '" + viewer->robot.substr(0, 64) + "'";
    }
    if (!bus_fault_.empty()) status.why = bus_fault_;
    status.robot = viewer->robot;
    for (const std::string& robot : robots_)
      if (is_for(*viewer, robot)) status.robots.push_back(robot);
    status.codec = viewer->codec;
    if (viewer->codec == VideoCodec::h264 && source != sources_.end())
      status.bit_rate = source->second->coder.bit_rate();
    if (viewer->status_sent && status == viewer->sent_status) continue;
    viewer->client->send(std::make_shared<const std::string>(video_status_text(status)), false);
    viewer->sent_status = std::move(status);
    viewer->status_sent = true;
  }
}

}  // namespace parhelion::station
