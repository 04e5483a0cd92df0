// Checks of the machine, one function each; `parhelion doctor` prints the results.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace parhelion::tools {

struct MachineCheck {
  enum class Verdict : std::uint8_t { ok, warn, fail };
  std::string name;
  Verdict verdict = Verdict::ok;
  std::string finding;  ///< what was found
  std::string remedy;   ///< what to do; empty if ok
};

/// Opens the bus at `url` (empty: the default one).
MachineCheck check_multicast(const std::string& url);
/// Sends messages of 300 kB to itself and counts those received.
MachineCheck check_big_messages(const std::string& url);
/// `rmem_max`: the kernel's file with the maximum receive buffer of a program.
MachineCheck check_receive_buffer(const std::filesystem::path& rmem_max);
/// EGL without a display: creates a context and names its renderer.
MachineCheck check_egl();
/// Free space for session logs in `folder`.
MachineCheck check_disk(const std::filesystem::path& folder);
MachineCheck check_processors();
/// True if this user may run programs with real-time priority: `serve --real-time`.
MachineCheck check_real_time();
/// The recording that `parhelion demo` plays.
MachineCheck check_recording(const std::filesystem::path& rawlog);
/// Files installed with the program.
MachineCheck check_shipped_files();

}  // namespace parhelion::tools
