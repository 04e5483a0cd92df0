// Reads the site settings of a scenario that are not part of its model, from YAML.
#pragma once

#include <vector>

#include "protocols/hazard.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"
#include "protocols/zone.hpp"

namespace parhelion {

/// `list` has passed yaml::check(); errors go to `problems`.
std::vector<Zone> read_zones(const yaml::Node& list, yaml::Problems& problems);
void write_zones(const std::vector<Zone>& zones, yaml::Writer& writer);
std::vector<Hazard> read_hazards(const yaml::Node& list, yaml::Problems& problems);
void write_hazards(const std::vector<Hazard>& hazards, yaml::Writer& writer);
HazardSensor read_hazard_sensor(const yaml::Node& node, yaml::Problems& problems);
void write(const HazardSensor& sensor, yaml::Writer& writer);
DoseLimits read_dose_limits(const yaml::Node& node, yaml::Problems& problems);
void write(const DoseLimits& limits, yaml::Writer& writer);
Radio read_radio(const yaml::Node& node, yaml::Problems& problems);
void write(const Radio& radio, yaml::Writer& writer);
Battery read_battery(const yaml::Node& node, yaml::Problems& problems);
void write(const Battery& battery, yaml::Writer& writer);

}  // namespace parhelion
