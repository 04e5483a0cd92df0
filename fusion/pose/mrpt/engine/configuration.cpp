#include "fusion/pose/mrpt/engine/configuration.hpp"

#include <algorithm>
#include <exception>
#include <fstream>
#include <iterator>

namespace parhelion::pose {
namespace {

std::string named(const std::string& path) { return path.empty() ? "the default configuration" : path; }

/// MRPT's messages end with the places in its sources that they went through.
std::string first_line(const char* what) {
  std::string text = what;
  text.erase(std::min(text.find('\n'), text.size()));
  return text;
}

}  // namespace

Result<mrpt::config::CConfigFileMemory> read_configuration(const std::string& path, const char* defaults,
                                                           std::span<const char* const> sections) {
  std::string text = defaults;
  if (!path.empty()) {
    std::ifstream file(path, std::ios::binary);
    text.assign(std::istreambuf_iterator<char>(file), {});
    if (!file) return Error{path + ": cannot be read; --mrpt-config expects a configuration file of MRPT"};
  }
  mrpt::config::CConfigFileMemory configuration;
  const Status parsed = load_options(path, [&] { configuration.setContent(text); });
  if (!parsed) return parsed.error();
  for (const char* section : sections) {
    if (configuration.sectionExists(section)) continue;
    std::vector<std::string> there;
    configuration.getAllSections(there);
    std::string list;
    for (const std::string& name : there) list += (list.empty() ? "[" : ", [") + name + "]";
    return Error{named(path) + ": has no section [" + section +
                 "], which this engine of MRPT reads; it has " + (list.empty() ? "none" : list)};
  }
  return configuration;
}

Status load_options(const std::string& path, const std::function<void()>& load) {
  try {
    load();
  } catch (const std::exception& error) {
    return Error{named(path) + ": MRPT refuses it: " + first_line(error.what())};
  }
  return {};
}

}  // namespace parhelion::pose
