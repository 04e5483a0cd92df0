#include "fusion/semantic/texture/build_texture.hpp"

#include <algorithm>
#include <string>

#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/texture/auto_exposure.hpp"
#include "fusion/semantic/texture/exposure.hpp"
#include "fusion/semantic/texture/model_surface.hpp"
#include "fusion/semantic/texture/movers.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kSameInstant = 0.04;  ///< s
constexpr double kMover = 0.01;        ///< of an image's pixels: less is not worth a word
constexpr int kSmallest = 16;          ///< pixels a side
constexpr double kCoarser = 1.5;
constexpr double kCoarsest = 0.2;  ///< m

template <class View>
Status check(const std::vector<View>& views, const char* kind, std::size_t values_per_pixel,
             auto&& values_of) {
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Pinhole& c = views[i].camera;
    const std::string name = std::string(kind) + " image " + std::to_string(i + 1);
    if (c.width < kSmallest || c.height < kSmallest)
      return Error{name + " has " + std::to_string(c.width) + "x" + std::to_string(c.height) +
                   " pixels, expected at least 16x16"};
    const Eigen::Vector4d numbers(c.fx, c.fy, c.cx, c.cy);
    if (!numbers.allFinite() || c.fx <= 0 || c.fy <= 0) return Error{name + ": its camera is not calibrated"};
    if (!views[i].T_map_optical.finite()) return Error{name + ": its pose is not finite"};
    if (values_of(views[i]) != values_per_pixel * c.pixels())
      return Error{name + ": its size differs from its camera's, " + std::to_string(c.width) + " x " +
                   std::to_string(c.height)};
  }
  return {};
}

/// A pixel of a depth image that showed what passed.
struct LeftOut {
  std::uint32_t at;
  std::uint16_t millimetres;
};

class Builder {
 public:
  Builder(const SemanticModel& model, std::vector<ColourView> views, std::vector<DepthView> depth,
          const TextureOptions& options, const std::function<void(const char*)>& progress)
      : model_(model),
        views_(std::move(views)),
        depth_(std::move(depth)),
        options_(options),
        progress_(progress) {}

  Result<BuiltTexture> build() {
    leave_out_movers_of_depth();
    if (const Status made = make_surface(); !made) return made.error();
    if (surface_.empty())
      return Error{
          "nothing to texture: the model is empty, and there is no depth image that measured anything"};
    leave_out_movers_of_colour();
    compare_views();
    stage("colours");
    const BakedSurface baked = bake(surface_, views_, geometry_, gains_, options_.bake);
    if (std::none_of(baked.seen.begin(), baked.seen.end(), [](bool seen) { return seen; }))
      return Error{"no image shows the site: the poses are not in the model's map, or it is another site"};
    return finish(baked);
  }

 private:
  void stage(const char* name) const {
    if (progress_) progress_(name);
  }

  void leave_out_movers_of_depth() {
    const auto movers = passing(depth_, options_.movers);
    left_out_.resize(depth_.size());
    for (std::size_t v = 0; v < depth_.size(); ++v)
      for (std::size_t i = 0; i < movers[v].size(); ++i)
        if (movers[v][i] != 0) {
          left_out_[v].push_back({static_cast<std::uint32_t>(i), depth_[v].millimetres[i]});
          depth_[v].millimetres[i] = 0;
        }
  }

  /// The depth image that was taken with a colour image, none: the number of all.
  std::size_t depth_with(const ColourView& view) const {
    std::size_t best = depth_.size();
    Duration min_off = seconds(kSameInstant);
    for (std::size_t d = 0; view.stamp && d < depth_.size(); ++d) {
      if (!depth_[d].stamp) continue;
      const Duration apart = *view.stamp - *depth_[d].stamp;
      const Duration off = apart < Duration{} ? -apart : apart;
      if (off < min_off) min_off = off, best = d;
    }
    return best;
  }

  void leave_out_movers_of_colour() {
    for (ColourView& view : views_) view.witnessed.clear();
    geometry_ = geometry_of(surface_, views_, options_.threads);
    cloud::for_each_chunk(views_.size(), 1, options_.threads, [&](std::size_t v, std::size_t, std::size_t) {
      const std::size_t d = depth_with(views_[v]);
      if (d < depth_.size()) views_[v].witnessed = witnessed_by(d, geometry_[v]);
    });
  }

  std::vector<Witnessed> witnessed_by(std::size_t d, const ViewGeometry& geometry) const {
    DepthView measured = depth_[d];
    std::vector<std::uint8_t> mover(measured.millimetres.size());
    for (const LeftOut& pixel : left_out_[d])
      measured.millimetres[pixel.at] = pixel.millimetres, mover[pixel.at] = 1;
    return compare_depth(geometry, measured, mover, depth_, options_.movers);
  }

  /// Coarser where a site is too large for one picture.
  Status make_surface() {
    stage("surface");
    const std::size_t side = kMaxTextureSide / static_cast<std::size_t>(options_.bake.patch) - 1;
    const std::size_t limit = std::min(kMaxTextureQuads, side * side);
    for (;;
         options_.volume.voxel *= kCoarser, options_.cell *= kCoarser, options_.cell_no_depth *= kCoarser) {
      surface_ = depth_.empty() ? QuadSurface{} : without_moving(fuse_depth(depth_, options_.volume), model_);
      measured_ = surface_.quads.size();
      const double cell = depth_.empty() ? options_.cell_no_depth : options_.cell;
      append(surface_, unmeasured(surface_of(model_, cell), surface_, depth_, options_.threads));
      if (surface_.quads.size() <= limit) return {};
      if (options_.volume.voxel > kCoarsest)
        return Error{"the site is too large for one texture; give parts of the log, or a part of the model"};
    }
  }

  void compare_views() {
    stage("poses");
    std::vector<Eigen::Vector3d> given;
    for (const ColourView& view : views_) given.push_back(view.T_map_optical.translation());
    sample();
    lens_ = align_views(views_, gains_, samples_, options_.align);
    for (ColourView& view : views_) view = corrected(std::move(view), lens_);
    leave_out_movers_of_colour();
    sample();
    for (std::size_t v = 0; v < views_.size(); ++v)
      moved_.push_back((views_[v].T_map_optical.translation() - given[v]).norm());
  }

  void sample() {
    geometry_ = geometry_of(surface_, views_, options_.threads);
    samples_ = sample_surface(surface_, geometry_, options_.samples, options_.threads);
    gains_ = exposure_gains(views_, samples_);
  }

  BuiltTexture finish(const BakedSurface& baked) {
    BuiltTexture built;
    built.texture.map_id = model_.map_id;
    built.texture.vertices = std::move(surface_.vertices);
    built.texture.quads = std::move(surface_.quads);
    for (const bool seen : baked.seen) {
      built.texture.looks.push_back(seen ? QuadLook::recorded : QuadLook::unseen);
      built.seen += seen;
    }
    built.texture.patch = baked.patch;
    built.texture.patches_per_row = baked.patches_per_row();
    built.texture.exposure = fit_auto_exposure(views_, geometry_, gains_);
    built.width = baked.width, built.height = baked.height;
    built.rgb = baked.rgb;
    built.measured = measured_;
    std::nth_element(moved_.begin(), moved_.begin() + static_cast<std::ptrdiff_t>(moved_.size() / 2),
                     moved_.end());
    built.moved = moved_[moved_.size() / 2];
    built.lens = lens_;
    for (const ColourView& view : views_) {
      const auto pixels = std::count(view.witnessed.begin(), view.witnessed.end(), Witnessed::contradicts);
      built.with_movers += static_cast<double>(pixels) > kMover * static_cast<double>(view.camera.pixels());
    }
    return built;
  }

  const SemanticModel& model_;
  std::vector<ColourView> views_;
  std::vector<DepthView> depth_;                ///< without movers
  std::vector<std::vector<LeftOut>> left_out_;  ///< of each depth image
  TextureOptions options_;
  const std::function<void(const char*)>& progress_;
  QuadSurface surface_;
  std::size_t measured_ = 0;
  std::vector<ViewGeometry> geometry_;
  std::vector<SurfaceSample> samples_;
  std::vector<Eigen::Vector3f> gains_;
  LensError lens_;
  std::vector<double> moved_;
};

}  // namespace

Result<BuiltTexture> build_texture(const SemanticModel& model, std::vector<ColourView> views,
                                   std::vector<DepthView> depth, TextureOptions options,
                                   const std::function<void(const char*)>& progress) {
  if (views.empty()) return Error{"no colour image with a pose"};
  const Status colour = check(views, "colour", 3, [](const ColourView& view) { return view.rgb.size(); });
  if (!colour) return colour.error();
  const Status deep = check(depth, "depth", 1, [](const DepthView& view) { return view.millimetres.size(); });
  if (!deep) return deep.error();
  options.volume.threads = options.bake.threads = options.align.threads = options.movers.threads =
      options.threads;
  return Builder(model, std::move(views), std::move(depth), options, progress).build();
}

}  // namespace parhelion::semantic
