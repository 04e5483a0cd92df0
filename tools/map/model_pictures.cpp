#include "tools/map/model_pictures.hpp"

#include <algorithm>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/build_model.hpp"
#include "fusion/semantic/pictures/model_plan.hpp"
#include "fusion/semantic/pictures/plan_view.hpp"
#include "fusion/semantic/pictures/png_compression.hpp"
#include "protocols/length_text.hpp"
#include "render/model_view.hpp"

namespace parhelion::tools {
namespace {

/// "7 walls, 2 doors, 1 flight of stairs; floor 0.00 m, ceiling 2.95 m"
std::string contents(const SemanticModel& model) {
  std::map<EntityLabel, std::size_t> count;
  std::map<std::string, bool> flights;
  for (const ModelEntity& e : model.entities) {
    if (e.deleted) continue;
    ++count[e.label];
    if (e.label == EntityLabel::stairs) flights[e.part_of.empty() ? e.name : e.part_of] = true;
  }
  std::string words;
  const auto add = [&](std::size_t n, const char* one, const char* many) {
    if (n > 0) words += (words.empty() ? "" : ", ") + std::to_string(n) + ' ' + (n == 1 ? one : many);
  };
  add(count[EntityLabel::wall], "wall", "walls");
  add(count[EntityLabel::door], "door", "doors");
  add(count[EntityLabel::window], "window", "windows");
  add(count[EntityLabel::pillar], "pillar", "pillars");
  add(flights.size(), "flight of stairs", "flights of stairs");
  add(count[EntityLabel::unknown], "unknown box", "unknown boxes");
  if (const auto floor = semantic::ground_floor(model)) words += "; floor " + length_text(*floor);
  if (const auto ceiling = semantic::largest_ceiling(model)) words += ", ceiling " + length_text(*ceiling);
  return words;
}

Status write_png(const cv::Mat& picture, const std::filesystem::path& path) {
  if (cv::imwrite(path.string(), picture, {cv::IMWRITE_PNG_COMPRESSION, semantic::kPngCompression}))
    return {};
  return Error{path.string() + ": the picture cannot be written"};
}

/// A picture that owns its pixels.
template <class Pixels>
cv::Mat picture_of(Pixels& pixels) {
  return cv::Mat(pixels.height, pixels.width, CV_8UC3, pixels.bgr.data()).clone();
}

Result<cv::Mat> plan_view(const SemanticModel& model, const std::string& name, const ModelRemarks& remarks) {
  semantic::ModelPlan plan;
  plan.title = name + ": plan";
  plan.subtitle = contents(model);
  plan.remarks = remarks;
  auto pixels = semantic::draw_model_plan(model, plan);
  if (!pixels) return pixels.error();
  return picture_of(*pixels);
}

Result<cv::Mat> solid_view(const SemanticModel& model, const std::string& name) {
  render::ModelView view;
  view.title = name + ": from above at an angle";
  view.subtitle = "ceilings left out, near walls cut to 0.9 m";
  auto pixels = render::draw_model_view(semantic::main_part(model).model, view);
  if (!pixels) return pixels.error();
  return picture_of(*pixels);
}

}  // namespace

Status draw_model(const SemanticModel& model, const std::string& name, ModelPicture what,
                  const std::filesystem::path& path, std::string* note, const ModelRemarks& remarks) {
  if (what == ModelPicture::solid) {
    const auto solid = solid_view(model, name);
    return solid ? write_png(*solid, path) : Status(solid.error());
  }
  if (what == ModelPicture::plan) {
    const auto plan = plan_view(model, name, remarks);
    return plan ? write_png(*plan, path) : Status(plan.error());
  }
  Result<cv::Mat> plan = cv::Mat(), solid = cv::Mat();
  cloud::run_both(
      0, [&] { plan = plan_view(model, name, remarks); }, [&] { solid = solid_view(model, name); });
  if (!plan) return plan.error();
  if (!solid) {
    if (note != nullptr) *note = "the 3D view is left out: " + solid.error().message;
    return write_png(*plan, path);
  }
  cv::Mat both;
  cv::vconcat(*plan, *solid, both);
  return write_png(both, path);
}

}  // namespace parhelion::tools
