#include "render/layer_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "render/shaders.hpp"

namespace parhelion {
namespace {

constexpr double kFarMargin = 1.0;  ///< m
/// Key light in the map: high, a little to one side, as lamps of a room are.
const Eigen::Vector3d kToLight = Eigen::Vector3d(0.35, 0.25, 0.9).normalized();

const void* offset_of(std::size_t bytes) { return reinterpret_cast<const void*>(bytes); }

std::string fragment_source(std::initializer_list<const char*> parts) {
  std::string source = "#version 310 es\nprecision highp float;\nprecision highp int;\n";
  for (const char* part : parts) source += part;
  return source;
}

}  // namespace

Result<std::unique_ptr<LayerRenderer>> LayerRenderer::create(EglContext& context) {
  context.make_current();
  std::unique_ptr<LayerRenderer> renderer(new LayerRenderer(context));
  const Gl& gl = renderer->gl_;
  renderer->software_ = context.renderer().find("llvmpipe") != std::string::npos ||
                        context.renderer().find("softpipe") != std::string::npos;
  GLint samples = 1, integer_samples = 1;
  gl.GetIntegerv(GL_MAX_SAMPLES, &samples);
  gl.GetIntegerv(GL_MAX_INTEGER_SAMPLES, &integer_samples);
  renderer->samples_ = std::min({4, static_cast<int>(samples), static_cast<int>(integer_samples)});
  if (renderer->samples_ < 2)
    return Error{"rendering: the driver has no multisampling; install libgl1-mesa-dri"};
  using namespace shaders;
  const auto make = [&](Program& program, const char* vertex, std::initializer_list<const char*> parts) {
    return renderer->make_program(program, vertex, fragment_source(parts));
  };
  for (const Status& status :
       {make(renderer->lit_, kShapeVertex, {kDepthIdFunction, kLitFunction, kShapeFragment}),
        make(renderer->depth_, kShapeVertex, {kDepthIdFunction, kDepthFragment}),
        make(renderer->shadow_, kShadowVertex, {kShadowFragment}),
        make(renderer->backdrop_, kBackdropVertex, {kLitFunction, kSceneryFunction, kBackdropFragment}),
        make(renderer->scenery_, kShapeVertex, {kLitFunction, kSceneryFunction, kSceneryFragment})})
    if (!status) return status.error();
  renderer->make_meshes();
  renderer->make_instance_array();
  return renderer;
}

LayerRenderer::~LayerRenderer() {
  context_.make_current();
  for (Target* target : {&multisampled_, &resolved_, &single_}) release(*target);
  const GLuint buffers[] = {vertex_buffer_, index_buffer_, instance_buffer_, shadow_buffer_};
  gl_.DeleteBuffers(4, buffers);
  const GLuint arrays[] = {shape_array_, shadow_array_, empty_array_};
  gl_.DeleteVertexArrays(3, arrays);
  for (const Program* program : {&lit_, &depth_, &shadow_, &backdrop_, &scenery_})
    gl_.DeleteProgram(program->id);
}

Status LayerRenderer::make_program(Program& program, const char* vertex, const std::string& fragment) {
  program.id = gl_.CreateProgram();
  const char* sources[] = {vertex, fragment.c_str()};
  for (const GLenum kind : {GL_VERTEX_SHADER, GL_FRAGMENT_SHADER}) {
    const GLuint shader = gl_.CreateShader(kind);
    gl_.ShaderSource(shader, 1, &sources[kind == GL_FRAGMENT_SHADER], nullptr);
    gl_.CompileShader(shader);
    GLint done = 0;
    gl_.GetShaderiv(shader, GL_COMPILE_STATUS, &done);
    if (!done) {
      char log[1024] = "";
      gl_.GetShaderInfoLog(shader, sizeof log, nullptr, log);
      return Error{std::string("rendering: the driver refuses a shader: ") + log};
    }
    gl_.AttachShader(program.id, shader);
    gl_.DeleteShader(shader);
  }
  gl_.LinkProgram(program.id);
  GLint linked = 0;
  gl_.GetProgramiv(program.id, GL_LINK_STATUS, &linked);
  if (!linked) {
    char log[1024] = "";
    gl_.GetProgramInfoLog(program.id, sizeof log, nullptr, log);
    return Error{std::string("rendering: the driver refuses a program: ") + log};
  }
  program.R_view_optical = gl_.GetUniformLocation(program.id, "R_view_optical");
  program.pinhole = gl_.GetUniformLocation(program.id, "pinhole");
  program.depth_range = gl_.GetUniformLocation(program.id, "depth_range");
  program.up = gl_.GetUniformLocation(program.id, "up");
  program.to_light = gl_.GetUniformLocation(program.id, "to_light");
  program.R_map_view = gl_.GetUniformLocation(program.id, "R_map_view");
  program.inverse_pinhole = gl_.GetUniformLocation(program.id, "inverse_pinhole");
  program.camera = gl_.GetUniformLocation(program.id, "camera");
  return {};
}

/// All meshes in one vertex buffer and one index buffer.
void LayerRenderer::make_meshes() {
  std::vector<MeshVertex> vertices;
  std::vector<std::uint32_t> indices;
  for (const ShapeKind kind : {ShapeKind::box, ShapeKind::cylinder, ShapeKind::sphere, ShapeKind::capsule}) {
    for (int level = 0; level < (kind == ShapeKind::box ? 1 : kLevels); ++level) {
      for (const bool bevelled : {false, true}) {
        const bool rounded = kind == ShapeKind::sphere || kind == ShapeKind::capsule;
        if (rounded && !bevelled) continue;
        const Mesh mesh = make_mesh(kind, kSegments[level], bevelled);
        MeshRange& range = meshes_[mesh_index(kind, level, bevelled)];
        range = {static_cast<GLsizei>(mesh.indices.size()), indices.size() * sizeof(std::uint32_t)};
        for (const auto i : mesh.indices) indices.push_back(static_cast<std::uint32_t>(vertices.size()) + i);
        vertices.insert(vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
      }
    }
  }
  plain_box_ = mesh_index(ShapeKind::box, 0, false);
  gl_.GenVertexArrays(1, &shape_array_);
  gl_.BindVertexArray(shape_array_);
  GLuint buffers[4];
  gl_.GenBuffers(4, buffers);
  vertex_buffer_ = buffers[0], index_buffer_ = buffers[1], instance_buffer_ = buffers[2],
  shadow_buffer_ = buffers[3];
  gl_.BindBuffer(GL_ARRAY_BUFFER, vertex_buffer_);
  gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(MeshVertex)),
                 vertices.data(), GL_STATIC_DRAW);
  gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, index_buffer_);
  gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)),
                 indices.data(), GL_STATIC_DRAW);
}

void LayerRenderer::make_instance_array() {
  const auto attribute = [&](GLuint location, GLint size, std::size_t stride, std::size_t offset,
                             GLuint divisor) {
    gl_.EnableVertexAttribArray(location);
    gl_.VertexAttribPointer(location, size, GL_FLOAT, GL_FALSE, static_cast<GLsizei>(stride),
                            offset_of(offset));
    gl_.VertexAttribDivisor(location, divisor);
  };
  attribute(0, 3, sizeof(MeshVertex), offsetof(MeshVertex, core), 0);
  attribute(1, 3, sizeof(MeshVertex), offsetof(MeshVertex, direction), 0);
  gl_.BindBuffer(GL_ARRAY_BUFFER, instance_buffer_);
  constexpr std::size_t kFloat = sizeof(float);
  for (GLuint column = 0; column < 3; ++column)
    attribute(2 + column, 3, sizeof(Instance), offsetof(Instance, rotation) + column * 3 * kFloat, 1);
  attribute(5, 3, sizeof(Instance), offsetof(Instance, translation), 1);
  attribute(6, 4, sizeof(Instance), offsetof(Instance, scale), 1);
  attribute(7, 4, sizeof(Instance), offsetof(Instance, albedo), 1);
  attribute(8, 2, sizeof(Instance), offsetof(Instance, metallic), 1);
  gl_.GenVertexArrays(1, &empty_array_);
  gl_.GenVertexArrays(1, &shadow_array_);
  gl_.BindVertexArray(shadow_array_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, shadow_buffer_);
  attribute(0, 3, sizeof(ShadowVertex), offsetof(ShadowVertex, position), 0);
  attribute(1, 2, sizeof(ShadowVertex), offsetof(ShadowVertex, local), 0);
  attribute(2, 2, sizeof(ShadowVertex), offsetof(ShadowVertex, half), 0);
  attribute(3, 4, sizeof(ShadowVertex), offsetof(ShadowVertex, corner), 0);
}

void LayerRenderer::release(Target& target) {
  gl_.DeleteFramebuffers(1, &target.framebuffer);
  const GLuint buffers[] = {target.colour, target.identity, target.depth};
  gl_.DeleteRenderbuffers(3, buffers);
  target = {};
}

/// Grows a frame buffer to hold a view; never shrinks it.
Status LayerRenderer::ensure(Target& target, int width, int height, int samples, bool colour, bool depth) {
  if (target.framebuffer && target.width >= width && target.height >= height) return {};
  const int w = std::max(width, target.width), h = std::max(height, target.height);
  release(target);
  gl_.GenFramebuffers(1, &target.framebuffer);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
  const auto attach = [&](GLuint& buffer, GLenum format, GLenum attachment) {
    gl_.GenRenderbuffers(1, &buffer);
    gl_.BindRenderbuffer(GL_RENDERBUFFER, buffer);
    gl_.RenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, w, h);
    gl_.FramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer);
  };
  if (colour) attach(target.colour, GL_RGBA8, GL_COLOR_ATTACHMENT0);
  attach(target.identity, GL_R32UI, GL_COLOR_ATTACHMENT1);
  if (depth) attach(target.depth, GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT);
  target.width = w, target.height = h;
  if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    release(target);
    return Error{"rendering: the driver has no frame buffer of " + std::to_string(w) + "x" +
                 std::to_string(h)};
  }
  return {};
}

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

void LayerRenderer::draw_shadows(const std::vector<ShadowVertex>& shadows, bool over_scenery) {
  if (shadows.empty()) return;
  gl_.BindVertexArray(shadow_array_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, shadow_buffer_);
  gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(shadows.size() * sizeof(ShadowVertex)),
                 shadows.data(), GL_STREAM_DRAW);
  // Overlapping shadows of one robot's parts do not add up: the darkest stands. A picture that is there
  // already is darkened.
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
  gl_.ClearBufferfi(GL_DEPTH_STENCIL, 0, 1.F, 0);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_LESS);
  gl_.Enable(GL_CULL_FACE);
  gl_.CullFace(GL_BACK);
  gl_.FrontFace(GL_CW);  // rows grow downwards, which turns every winding round
  if (scenery) {
    gl_.DrawBuffers(2, colour_only);
    draw_scenery(view, *scenery, far, R_optical_map);
  }
  if (use_occluders && !list.occluders.empty()) {
    gl_.DrawBuffers(2, none);
    use(depth_, view, far, 0, nullptr);
    draw_instances(plain_box_, list.occluders);
  }
  if (!list.shadows.empty()) {
    gl_.DrawBuffers(2, colour_only);
    use(shadow_, view, far, kOcclusionBias, nullptr);
    draw_shadows(list.shadows, scenery != nullptr);
  }
  gl_.DrawBuffers(2, both);
  use(lit_, view, far, kOcclusionBias, &R_optical_map);
  for (std::size_t mesh = 0; mesh < kMeshes; ++mesh) draw_instances(mesh, list.shapes[mesh]);
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

/// A software driver pays two and a half times for four samples a pixel: it gets them where little is drawn,
/// and the edge filter where much is.
bool LayerRenderer::affords_multisampling(const DrawList& list) const {
  if (!software_) return true;
  constexpr std::size_t kTriangles = 4000, kPixels = 150'000;
  std::size_t triangles = 0, pixels = 0;
  for (std::size_t mesh = 0; mesh < kMeshes; ++mesh)
    triangles += list.shapes[mesh].size() * static_cast<std::size_t>(meshes_[mesh].count / 3);
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
  scenery_drawn_ = scenery != nullptr;
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
    // The last view stays with the driver until it is read; earlier ones make room for the next.
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
  if (!multisampling_) smooth_edges(layer, scenery_drawn_);
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
    gl_.ClearBufferfi(GL_DEPTH_STENCIL, 0, 1.F, 0);
    gl_.Enable(GL_DEPTH_TEST);
    gl_.DepthFunc(GL_LESS);
    gl_.Enable(GL_CULL_FACE);
    gl_.CullFace(GL_BACK);
    gl_.FrontFace(GL_CW);
    use(depth_, view, far, 0, nullptr);
    if (what == Depth::occluders) {
      draw_instances(plain_box_, list.occluders);
    } else {
      for (std::size_t mesh = 0; mesh < kMeshes; ++mesh) draw_instances(mesh, list.shapes[mesh]);
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

}  // namespace parhelion
