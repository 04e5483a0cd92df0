// MRPT's configuration files. Internal to this folder.
#pragma once

#include <mrpt/config/CConfigFileMemory.h>

#include <functional>
#include <span>
#include <string>

#include "protocols/status.hpp"

namespace parhelion::pose {

/// The file's text, or `defaults` where `path` is empty. Error: it cannot be read, or lacks one of
/// `sections`.
Result<mrpt::config::CConfigFileMemory> read_configuration(const std::string& path, const char* defaults,
                                                           std::span<const char* const> sections);

/// Runs `load`, and makes an error of what MRPT throws: it names section and key.
Status load_options(const std::string& path, const std::function<void()>& load);

}  // namespace parhelion::pose
