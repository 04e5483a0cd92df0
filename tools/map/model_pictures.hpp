// Pictures of a semantic model: the plan, the solid view, or both in one picture.
#pragma once

#include <filesystem>
#include <string>

#include "protocols/model.hpp"
#include "protocols/model_objects.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

enum class ModelPicture { both, plan, solid };

/// Writes a PNG. `name`: of the model, for the title. If only the solid view of `both` cannot be drawn (no
/// EGL), the plan is written and the reason is in `note`. The plan shows the objects and doubtful parts of
/// `remarks`.
Status draw_model(const SemanticModel& model, const std::string& name, ModelPicture what,
                  const std::filesystem::path& path, std::string* note = nullptr,
                  const ModelRemarks& remarks = {});

}  // namespace parhelion::tools
