#include "tools/play/play_station.hpp"

#include <utility>

#include "server/station/foxglove/json_text.hpp"

namespace parhelion::tools {
namespace {

station::SessionControls controls_of(runtime::Player& player, PlayThread& thread) {
  const auto woken = [&thread](Status status) {
    thread.wake();
    return status;
  };
  station::SessionControls controls;
  controls.pause = [&player, woken](bool paused) {
    player.pause(paused);
    return woken({});
  };
  controls.rate = [&player, woken](double rate) { return woken(player.set_rate(rate)); };
  controls.seek = [&player, woken](double position) { return woken(player.seek(position)); };
  controls.step = [&player, woken] { return woken(player.step()); };
  controls.state = [&player] {
    const runtime::PlayState now = player.state();
    station::ControlState state;
    state.recorded = true;
    state.paused = now.paused;
    state.rate = now.rate;
    state.position = now.position;
    state.duration = now.duration;
    state.ended = now.ended;
    return state;
  };
  controls.marks = [&player] { return marks_json(player.recording().marks()); };
  return controls;
}

}  // namespace

Result<std::unique_ptr<station::BaseStation>> open_play_station(const std::string& address, MemoryBusHub& hub,
                                                                runtime::Player& player, PlayThread& thread) {
  auto configuration = tick::configuration_from(player.recording().session(), "the recording");
  if (!configuration) return configuration.error();
  station::BaseStationOptions options;
  options.address = address;
  options.station.configuration = std::make_shared<const tick::Configuration>(std::move(*configuration));
  options.station.recorded = true;
  options.station.controls = controls_of(player, thread);
  options.station.clock = [&player] { return player.clock(); };
  options.open_bus = [&hub] { return Result<std::unique_ptr<Bus>>(hub.connect()); };
  return station::BaseStation::open(std::move(options));
}

std::string marks_json(const std::vector<runtime::RecordedMark>& marks) {
  station::foxglove::JsonText json;
  json.open('[');
  for (const runtime::RecordedMark& mark : marks) {
    json.open('{').key("t").number(mark.t).key("kind").unescaped(mark.kind).key("text").string(mark.text);
    json.key("bad").boolean(mark.bad).close('}');
  }
  return std::string(json.close(']').text());
}

}  // namespace parhelion::tools
