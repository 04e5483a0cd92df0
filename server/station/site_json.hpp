// JSON of what never or rarely changes: the session, the building, the robots.
#pragma once

#include <string>

#include "server/station/http/identity.hpp"
#include "server/station/session_controls.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::station {

struct HelloFields {
  SimulationTime start;  ///< of the session
  WallTime now;          ///< the server's clock, to synchronize the page's
  bool recorded = false;
  bool mapped = false;    ///< a picture of the map exists
  bool textured = false;  ///< recorded surfaces of the site exist
  std::string marks;      ///< JSON list for the seek bar; empty: none
  bool can_pause = false, can_rate = false, can_seek = false, can_end = false, can_save = false;
};
/// hello: the first message to a page. A trainee's has the briefing, and nothing for instructors.
std::string hello_json(const tick::Configuration& configuration, const Identity& who,
                       const HelloFields& hello_fields);

/// GET /api/v1/model: {version, map_id, elements: [{name, label, at, turn, size, ...}], meshes}.
std::string site_json(const SemanticModel& model, std::uint64_t version);
/// GET /api/v1/robots: the trainee's robot and the robot models that agents may have; for a trainee only
/// those of robots that trainees drive.
std::string robots_json(const tick::Configuration& configuration, bool for_trainee = false);

}  // namespace parhelion::station
