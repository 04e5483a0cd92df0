// A grade in the records' tables, and back to the same bits.
#pragma once

#include "server/training/database.hpp"
#include "server/training/grader.hpp"

namespace parhelion::training {

/// `session`: the row that it belongs to, which has none yet.
Status insert_grade(Database& database, std::int64_t session, const Grade& grade);
/// Error: an outcome or event of a kind that this program does not know.
Result<Grade> read_grade(Database& database, std::int64_t session);

}  // namespace parhelion::training
