#include "render/layer_renderer.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::render {
namespace {

constexpr double kFarMargin = 1.0;  ///< m
/// Key light in the map: high and slightly to one side, like room lamps.
const Eigen::Vector3d kToLight = Eigen::Vector3d(0.35, 0.25, 0.9).normalized();

const void* offset_of(std::size_t bytes) { return reinterpret_cast<const void*>(bytes); }

}  // namespace

void LayerRenderer::use(const Program& program, const PinholeView& view, double far, double bias,
                        const Eigen::Matrix3d* R_optical_map) {
  gl_.UseProgram(program.id);
  const Eigen::Matrix3f R = view.R_optical_view.transpose().cast<float>();
  gl_.UniformMatrix3fv(program.R_view_optical, 1, GL_FALSE, R.data());
  const auto f = [](double x) { return static_cast<float>(x); };
  // Pixel centres are at integers, so the viewport spans [-0.5, size - 0.5].
  gl_.Uniform4f(program.pinhole, f(2 * view.fx / view.width), f(2 * (view.cx + 0.5) / view.width - 1),
                f(2 * view.fy / view.height), f(2 * (view.cy + 0.5) / view.height - 1));
  const double n = kNearPlane;
  gl_.Uniform4f(program.depth_range, f((far + n) / (far - n)), f(-2 * far * n / (far - n)), f(bias), 0);
  if (!R_optical_map) return;
  const Eigen::Vector3f up = R_optical_map->col(2).cast<float>();
  const Eigen::Vector3f light = (*R_optical_map * kToLight).cast<float>();
  gl_.Uniform3f(program.up, up.x(), up.y(), up.z());
  gl_.Uniform3f(program.to_light, light.x(), light.y(), light.z());
}

void LayerRenderer::draw_instances(std::size_t mesh, const std::vector<Instance>& instances) {
  if (instances.empty()) return;
  gl_.BindVertexArray(shape_array_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, instance_buffer_);
  gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(instances.size() * sizeof(Instance)),
                 instances.data(), GL_STREAM_DRAW);
  gl_.DrawElementsInstanced(GL_TRIANGLES, meshes_[mesh].count, GL_UNSIGNED_INT,
                            offset_of(meshes_[mesh].offset), static_cast<GLsizei>(instances.size()));
}

void LayerRenderer::draw_mesh(const std::vector<std::uint32_t>& chunks, const Instance& placed) {
  if (chunks.empty()) return;
  gl_.BindVertexArray(mesh_array_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, instance_buffer_);
  gl_.BufferData(GL_ARRAY_BUFFER, sizeof(Instance), &placed, GL_STREAM_DRAW);
  for (std::size_t i = 0; i < chunks.size();) {
    const std::uint32_t first = mesh_chunks_[chunks[i]].first;
    std::uint32_t count = 0;  // adjacent buffer ranges are drawn in one call
    for (; i < chunks.size() && mesh_chunks_[chunks[i]].first == first + count; ++i)
      count += mesh_chunks_[chunks[i]].count;
    gl_.DrawArrays(GL_TRIANGLES, static_cast<GLint>(first), static_cast<GLsizei>(count));
  }
}

/// A mesh whose faces are turned inside out, as some files have them, is drawn as well.
void LayerRenderer::draw_shape_meshes(const std::vector<PlacedMesh>& meshes) {
  if (meshes.empty()) return;
  gl_.Disable(GL_CULL_FACE);
  for (const PlacedMesh& placed : meshes) {
    const UploadedMesh& mesh = uploaded(placed.mesh);
    gl_.BindVertexArray(mesh.array);
    gl_.BindBuffer(GL_ARRAY_BUFFER, instance_buffer_);
    gl_.BufferData(GL_ARRAY_BUFFER, sizeof(Instance), &placed.instance, GL_STREAM_DRAW);
    gl_.DrawArrays(GL_TRIANGLES, 0, mesh.vertices);
  }
  gl_.Enable(GL_CULL_FACE);
}

void LayerRenderer::draw_shadows(const std::vector<ShadowVertex>& shadows, bool over_scenery) {
  if (shadows.empty()) return;
  gl_.BindVertexArray(shadow_array_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, shadow_buffer_);
  gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(shadows.size() * sizeof(ShadowVertex)),
                 shadows.data(), GL_STREAM_DRAW);
  // Overlapping shadows of one robot's parts do not add up: the darkest is used. An existing picture is
  // darkened.
  gl_.Enable(GL_BLEND);
  gl_.BlendEquation(over_scenery ? GL_FUNC_ADD : GL_MAX);
  gl_.BlendFunc(over_scenery ? GL_ZERO : GL_ONE, over_scenery ? GL_ONE_MINUS_SRC_ALPHA : GL_ONE);
  gl_.DepthMask(GL_FALSE);
  gl_.Disable(GL_CULL_FACE);
  gl_.DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(shadows.size()));
  gl_.Enable(GL_CULL_FACE);
  gl_.DepthMask(GL_TRUE);
  gl_.Disable(GL_BLEND);
}

void LayerRenderer::set_scissor(const PixelRect& rect) {
  gl_.Enable(GL_SCISSOR_TEST);
  gl_.Scissor(rect.x0, rect.y0, rect.width(), rect.height());
}

/// Occluders into depth, shadows over the floor, then the shapes.
void LayerRenderer::begin_depth() {
  gl_.ClearBufferfi(GL_DEPTH_STENCIL, 0, 1.F, 0);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_LESS);
  gl_.Enable(GL_CULL_FACE);
  gl_.CullFace(GL_BACK);
  gl_.FrontFace(GL_CW);  // rows grow downwards, which reverses every winding
}

void LayerRenderer::draw_view(const PinholeView& view, const PixelRect& rect, const DrawList& list,
                              const Eigen::Matrix3d& R_optical_map, bool use_occluders,
                              const Scenery* scenery) {
  const double far = list.farthest + kFarMargin;
  gl_.BindFramebuffer(GL_FRAMEBUFFER, (multisampling_ ? multisampled_ : resolved_).framebuffer);
  gl_.Viewport(0, 0, view.width, view.height);
  set_scissor(rect);
  const GLenum both[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  const GLenum colour_only[] = {GL_COLOR_ATTACHMENT0, GL_NONE};
  const GLenum none[] = {GL_NONE, GL_NONE};
  gl_.DrawBuffers(2, both);
  const GLfloat transparent[] = {0, 0, 0, 0};
  const GLuint nothing[] = {0, 0, 0, 0};
  gl_.ClearBufferfv(GL_COLOR, 0, transparent);
  gl_.ClearBufferuiv(GL_COLOR, 1, nothing);
  begin_depth();
  if (scenery) {
    gl_.DrawBuffers(2, colour_only);
    draw_scenery(view, *scenery, far, R_optical_map);
  }
  if (use_occluders &&
      !(list.occluders.empty() && list.occluder_meshes.empty() && list.mesh_chunks.empty())) {
    gl_.DrawBuffers(2, none);
    use(depth_, view, far, 0, nullptr);
    draw_instances(plain_box_, list.occluders);
    draw_shape_meshes(list.occluder_meshes);
    draw_mesh(list.mesh_chunks, list.mesh);
  }
  if (!list.shadows.empty()) {
    gl_.DrawBuffers(2, colour_only);
    use(shadow_, view, far, kOcclusionBias, nullptr);
    draw_shadows(list.shadows, scenery != nullptr);
  }
  gl_.DrawBuffers(2, both);
  use(lit_, view, far, kOcclusionBias, &R_optical_map);
  for (std::size_t mesh = 0; mesh < kMeshes; ++mesh) draw_instances(mesh, list.shapes[mesh]);
  draw_shape_meshes(list.shape_meshes);
  draw_mesh(list.mesh_shown, list.mesh);
}

void LayerRenderer::resolve(const PixelRect& r) {
  gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, multisampled_.framebuffer);
  gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved_.framebuffer);
  const GLenum targets[2][2] = {{GL_COLOR_ATTACHMENT0, GL_NONE}, {GL_NONE, GL_COLOR_ATTACHMENT1}};
  for (const GLenum attachment : {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1}) {
    gl_.ReadBuffer(attachment);
    gl_.DrawBuffers(2, targets[attachment - GL_COLOR_ATTACHMENT0]);
    gl_.BlitFramebuffer(r.x0, r.y0, r.x1, r.y1, r.x0, r.y0, r.x1, r.y1, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  }
}

/// Four samples per pixel take a software driver two and a half times as long: used where little is drawn,
/// the edge filter where much is.
bool LayerRenderer::affords_multisampling(const DrawList& list) const {
  if (!software_) return true;
  constexpr std::size_t kTriangles = 4000, kPixels = 150'000;
  std::size_t triangles = 0, pixels = 0;
  for (std::size_t mesh = 0; mesh < kMeshes; ++mesh)
    triangles += list.shapes[mesh].size() * static_cast<std::size_t>(meshes_[mesh].count / 3);
  for (const PlacedMesh& placed : list.shape_meshes) triangles += placed.mesh->triangles.size();
  for (const PixelRect& rect : list.view_rects)
    if (!rect.empty())
      pixels += static_cast<std::size_t>(rect.width()) * static_cast<std::size_t>(rect.height());
  return triangles <= kTriangles && pixels <= kPixels;
}

void LayerRenderer::draw(const CameraProjection& projection, const DrawList& list,
                         const Eigen::Matrix3d& R_optical_map, bool use_occluders, const Scenery* scenery) {
  context_.make_current();
  const std::size_t views = projection.views().size();
  view_pixels_.resize(views);
  refused_ = {};
  multisampling_ = affords_multisampling(list);
  filters_scenery_ = scenery != nullptr && !scenery->recorded;
  for (std::size_t v = 0; v < views; ++v) {
    const PinholeView& view = projection.views()[v];
    ViewPixels& pixels = view_pixels_[v];
    pixels.rect = list.view_rects[v];
    if (pixels.rect.empty()) continue;
    refused_ = ensure(resolved_, view.width, view.height, 0, true, true);
    if (refused_.ok() && multisampling_)
      refused_ = ensure(multisampled_, view.width, view.height, samples_, true, true);
    if (!refused_) return;
    draw_view(view, pixels.rect, list, R_optical_map, use_occluders, scenery);
    const PixelRect& r = pixels.rect;
    if (multisampling_) resolve(r);
    // The last view stays in the driver until it is read; earlier ones are read before the next is drawn.
    if (v + 1 < views) read_view(resolved_.framebuffer, r, true, pixels.rgba, pixels.depth_id);
  }
  gl_.Flush();
}

void LayerRenderer::read_view(GLuint framebuffer, const PixelRect& r, bool colour,
                              std::vector<std::uint8_t>& rgba, std::vector<std::uint32_t>& depth_id) {
  const std::size_t count = static_cast<std::size_t>(r.width()) * static_cast<std::size_t>(r.height());
  gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
  if (colour) {
    rgba.resize(4 * count);
    gl_.ReadBuffer(GL_COLOR_ATTACHMENT0);
    gl_.ReadPixels(r.x0, r.y0, r.width(), r.height(), GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  }
  depth_id.resize(count);
  gl_.ReadBuffer(GL_COLOR_ATTACHMENT1);
  GLint format = 0;
  gl_.GetIntegerv(GL_IMPLEMENTATION_COLOR_READ_FORMAT, &format);
  if (format == GL_RED_INTEGER) {
    gl_.ReadPixels(r.x0, r.y0, r.width(), r.height(), GL_RED_INTEGER, GL_UNSIGNED_INT, depth_id.data());
    return;
  }
  wide_.resize(4 * count);  // the only other format that ES guarantees
  gl_.ReadPixels(r.x0, r.y0, r.width(), r.height(), GL_RGBA_INTEGER, GL_UNSIGNED_INT, wide_.data());
  for (std::size_t i = 0; i < count; ++i) depth_id[i] = wide_[4 * i];
}

Status LayerRenderer::read(const CameraProjection& projection, const DrawList& list, Layer& layer) {
  layer.rect = {};
  if (!refused_) return refused_;
  context_.make_current();
  for (std::size_t v = 0; v < list.view_rects.size(); ++v)
    layer.rect = layer.rect.united(projection.image_rect(v, list.view_rects[v]));
  if (layer.rect.empty()) return {};
  ViewPixels& last = view_pixels_.back();
  if (!last.rect.empty()) read_view(resolved_.framebuffer, last.rect, true, last.rgba, last.depth_id);
  if (const GLenum error = gl_.GetError(); error != GL_NO_ERROR) {
    layer.rect = {};
    return Error{"rendering: the driver reports error " + std::to_string(error)};
  }
  if (projection.direct()) {
    std::swap(layer.rgba, last.rgba);
    std::swap(layer.depth_id, last.depth_id);
  } else {
    warp(projection, true, layer);
  }
  if (!multisampling_) smooth_edges(layer, filters_scenery_);
  return {};
}

void LayerRenderer::read_depth(const CameraProjection& projection, const DrawList& list, Depth what,
                               Layer& layer) {
  context_.make_current();
  const double far = list.farthest + kFarMargin;
  layer.rect = {};
  view_pixels_.resize(projection.views().size());
  for (std::size_t v = 0; v < projection.views().size(); ++v) {
    const PinholeView& view = projection.views()[v];
    ViewPixels& pixels = view_pixels_[v];
    pixels.rect = list.view_rects[v];
    if (pixels.rect.empty()) continue;
    layer.rect = layer.rect.united(projection.image_rect(v, pixels.rect));
    if (!ensure(single_, view.width, view.height, 0, false, true)) {
      pixels.rect = {};
      continue;
    }
    gl_.BindFramebuffer(GL_FRAMEBUFFER, single_.framebuffer);
    gl_.Viewport(0, 0, view.width, view.height);
    set_scissor(pixels.rect);
    const GLenum targets[] = {GL_NONE, GL_COLOR_ATTACHMENT1};
    gl_.DrawBuffers(2, targets);
    const GLuint nothing[] = {0, 0, 0, 0};
    gl_.ClearBufferuiv(GL_COLOR, 1, nothing);
    begin_depth();
    use(depth_, view, far, 0, nullptr);
    if (what != Depth::shapes) {
      draw_instances(plain_box_, list.occluders);
      draw_shape_meshes(list.occluder_meshes);
      draw_mesh(list.mesh_chunks, list.mesh);
    }
    if (what != Depth::occluders) {
      for (std::size_t mesh = 0; mesh < kMeshes; ++mesh) draw_instances(mesh, list.shapes[mesh]);
      draw_shape_meshes(list.shape_meshes);
    }
    read_view(single_.framebuffer, pixels.rect, false, pixels.rgba, pixels.depth_id);
  }
  if (layer.rect.empty()) return;
  if (projection.direct()) {
    std::swap(layer.depth_id, view_pixels_[0].depth_id);
    if (view_pixels_[0].rect.empty()) layer.rect = {};
    return;
  }
  warp(projection, false, layer);
}

}  // namespace parhelion::render
