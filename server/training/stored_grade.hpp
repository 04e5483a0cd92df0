// Stores a grade in the records' tables, and reads back the same bits.
#pragma once

#include "server/training/database.hpp"
#include "server/training/grader.hpp"

namespace parhelion::training {

/// `session`: the row it belongs to, which must not have a grade yet.
Status insert_grade(Database& database, std::int64_t session, const Grade& grade);
/// Error: an unknown kind of outcome or event.
Result<Grade> read_grade(Database& database, std::int64_t session);

}  // namespace parhelion::training
