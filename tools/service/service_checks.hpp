// Checks of the set-up of parhelion.service and of the bus that it serves; `parhelion doctor` prints the
// results.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/service/machine_checks.hpp"

namespace parhelion::tools {

/// Unit, user, permitted priority and state folder. `root`: the machine's root folder. Without a unit there
/// is one result, which says so.
std::vector<MachineCheck> check_service(const std::filesystem::path& root);
/// Whether messages leave this machine, and by which of its addresses.
MachineCheck check_bus_reach(const std::string& url);
/// LCM_DEFAULT_URL in the settings of the service; empty: no settings, or none of it.
std::string service_url(const std::filesystem::path& root);

}  // namespace parhelion::tools
