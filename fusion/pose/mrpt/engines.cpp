#include "fusion/pose/mrpt/engines.hpp"

#include <dlfcn.h>

#include <filesystem>

#include "fusion/pose/mrpt/engine/module.hpp"

namespace parhelion::pose {
namespace {

/// Beside the program: in ../lib/parhelion where it is installed, and of a build's programs at most one
/// folder further up.
Result<const MrptEngines*> load() {
  std::error_code failed;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", failed).parent_path();
  std::string why = failed.message();
  for (const char* up : {"..", "../.."}) {
    const std::filesystem::path file = program / up / "lib/parhelion" / PARHELION_MRPT_ENGINES;
    if (!std::filesystem::exists(file, failed)) {
      why = file.lexically_normal().string() + " is not there";
      continue;
    }
    void* module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr) return Error{std::string("MRPT's engines cannot be loaded: ") + dlerror()};
    const void* engines = dlsym(module, kMrptEngines);
    if (engines == nullptr) return Error{file.string() + ": is not of this version of parhelion"};
    return static_cast<const MrptEngines*>(engines);
  }
  return Error{"MRPT's engines cannot be loaded: " + why};
}

/// Loaded once, and never unloaded: what it made may still live.
const Result<const MrptEngines*>& engines() {
  static const Result<const MrptEngines*> loaded = load();
  return loaded;
}

}  // namespace

Result<std::unique_ptr<Slam>> make_mrpt_mapper(const RobotDescription& robot, const SlamOptions& options) {
  if (!engines()) return engines().error();
  return (*engines())->mapper(robot, options);
}

Result<std::unique_ptr<Slam>> make_mrpt_localizer(const RobotDescription& robot, const std::string& map_path,
                                                  const SlamOptions& options) {
  if (!engines()) return engines().error();
  return (*engines())->localizer(robot, map_path, options);
}

}  // namespace parhelion::pose
