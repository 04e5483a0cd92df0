// A session log as a row of the trainees' records.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/runtime/grade_session.hpp"
#include "server/training/records.hpp"

namespace parhelion::runtime {

/// Graded by grade_session(), whose Errors and `progress` these are. Identity: SHA-256 of MR_SESSION and its
/// instant, so that a copy, a log that is cut off and a replay of the same are the same session, and one with
/// another scenario or seed is not.
Result<training::SessionRecord> session_record(
    const std::string& path, const std::function<void(std::uint64_t, std::uint64_t)>& progress = {});

/// SessionRecord::identity of a log, without grading it.
Result<std::string> session_identity(const std::string& path);

}  // namespace parhelion::runtime
