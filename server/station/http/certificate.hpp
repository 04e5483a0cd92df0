// The self-signed certificate of a server without a configured one.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion::station {

/// Creates an EC P-256 key and a certificate signed with it, valid for two years from `now` (since the
/// epoch), for `names` (host names and addresses), if `certificate` does not exist or ends within 30 days.
/// Otherwise leaves it unchanged, so that its fingerprint stays. Error: unreadable, or one of the two files
/// is missing.
Status make_certificate(const std::filesystem::path& certificate, const std::filesystem::path& key,
                        const std::vector<std::string>& names, WallTime now);

/// SHA-256 of the first certificate of a PEM file, as browsers show it: "AB:CD:...".
Result<std::string> certificate_fingerprint(const std::filesystem::path& certificate);

/// localhost, this machine's name and its addresses.
std::vector<std::string> own_names();

}  // namespace parhelion::station
