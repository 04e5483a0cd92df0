#include "tools/live_station.hpp"

#include <filesystem>

#include "server/review/page.hpp"
#include "server/runtime/trainees_report.hpp"
#include "server/station/http/web_site.hpp"
#include "tools/cloud_layer.hpp"
#include "tools/site_map.hpp"

namespace parhelion::tools {
namespace {

constexpr double kMinPlaybackRate = 0.1, kMaxPlaybackRate = 4;  // times real time

/// Pause and rate of a fully simulated session. A pause keeps the rate.
void put_pace(const std::shared_ptr<runtime::SessionClock>& clock, station::SessionControls& controls) {
  const auto rate = std::make_shared<double>(1);
  controls.pause = [clock, rate](bool paused) {
    clock->set_rate(paused ? 0 : *rate);
    return Status();
  };
  controls.rate = [clock, rate](double wanted) -> Status {
    if (!(wanted >= kMinPlaybackRate && wanted <= kMaxPlaybackRate))
      return Error{"a live session runs at 0.1 to 4 times real time"};
    *rate = wanted;
    if (clock->rate() > 0) clock->set_rate(wanted);
    return {};
  };
}

}  // namespace

Result<std::unique_ptr<LiveStation>> LiveStation::open(const LiveStationOptions& options,
                                                       const tick::Configuration& configuration) {
  auto live = std::make_unique<LiveStation>();
  live->log_ = options.session;
  station::BaseStationOptions base;
  base.address = options.address;
  base.folder =
      options.folder.empty() ? station::default_site_folder() : std::filesystem::path(options.folder);
  base.stopped_robots = options.stopped_robots;
  base.open_bus = options.open_bus;
  station::StationOptions& station = base.station;
  station.configuration = std::make_shared<const tick::Configuration>(configuration);
  station.notes = review::notes_path(options.session);
  station.scenarios = (base.folder / "scenarios").string();
  station.texture = options.texture;
  if (!options.cloud.empty()) {
    auto cloud = cloud_layer(options.cloud, configuration.model.T_map_cloud);
    if (!cloud) return cloud.error();
    station.cloud = std::move(*cloud);
  }
  station.controls.end = [it = live.get()] {
    it->ended_ = true;
    return Status();
  };
  station.map = draw_site_map(configuration.model);
  if (tick::simulates_trainee(configuration.scenario)) {
    live->clock_ = std::make_shared<runtime::SessionClock>();
    put_pace(live->clock_, station.controls);
    station.clock = [clock = live->clock_] { return clock->now(); };
  }
  station.controls.state = [it = live.get()] {
    station::ControlState state;
    state.ended = it->reported_;  // pages then request the report
    if (!it->clock_) return state;
    state.rate = it->clock_->rate();
    state.paused = state.rate == 0;
    return state;
  };
  auto opened = station::BaseStation::open(std::move(base));
  if (!opened) return opened.error();
  live->station_ = std::move(*opened);
  return live;
}

station::SessionReport session_report(const runtime::Report& report, const std::string& log) {
  const auto page = [&](review::Reader reader, const std::string& robot = {}) {
    auto review = review::review_session(log, {}, {}, reader, robot);
    if (!review) return std::string();
    review::ReviewPage one;
    one.sessions.push_back(std::move(*review));
    return review::to_html(one);
  };
  station::SessionReport all{to_json(report),
                             page(review::Reader::instructor),
                             to_trainees_json(report),
                             page(review::Reader::trainee),
                             {}};
  // Each page reads the log: those of the first graded robot are there already.
  const std::string first = report.grades.empty() ? std::string() : report.grades.front().robot;
  for (const runtime::RobotReport& robot : report.robots) {
    all.of_robots[robot.name] =
        robot.name == first ? station::SessionReport::Pages{all.page, all.trainees_page}
                            : station::SessionReport::Pages{page(review::Reader::instructor, robot.name),
                                                            page(review::Reader::trainee, robot.name)};
  }
  return all;
}

void LiveStation::show_report(const runtime::Report& report) {
  station_->set_report(session_report(report, log_));
  reported_ = true;
}

}  // namespace parhelion::tools
