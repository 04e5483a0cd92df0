// Programs, meshes and frame buffers of a layer renderer.
#include <algorithm>
#include <cstddef>
#include <initializer_list>

#include "render/layer_renderer.hpp"
#include "render/shaders.hpp"
#include "render/shape_mesh_vertices.hpp"

namespace parhelion::render {
namespace {

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
        make(renderer->scenery_, kShapeVertex, {kLitFunction, kSceneryFunction, kSceneryFragment}),
        make(renderer->site_, kSiteVertex, {kUnrecordedFunction, kSiteFragment}),
        make(renderer->unrecorded_, kBackdropVertex, {kUnrecordedFunction, kUnrecordedFragment})})
    if (!status) return status.error();
  renderer->make_meshes();
  renderer->make_instance_array();
  return renderer;
}

LayerRenderer::~LayerRenderer() {
  context_.make_current();
  for (Target* target : {&multisampled_, &resolved_, &single_}) release(*target);
  const GLuint buffers[] = {vertex_buffer_, index_buffer_, instance_buffer_, shadow_buffer_, mesh_buffer_};
  gl_.DeleteBuffers(5, buffers);
  const GLuint arrays[] = {shape_array_, shadow_array_, empty_array_, mesh_array_};
  gl_.DeleteVertexArrays(4, arrays);
  release_site();
  for (const auto& [mesh, uploaded] : shape_meshes_) {
    gl_.DeleteBuffers(1, &uploaded.buffer);
    gl_.DeleteVertexArrays(1, &uploaded.array);
  }
  for (const Program* program : {&lit_, &depth_, &shadow_, &backdrop_, &scenery_, &site_, &unrecorded_})
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

void LayerRenderer::attribute(GLuint location, GLint size, std::size_t stride, std::size_t offset,
                              GLuint divisor) {
  gl_.EnableVertexAttribArray(location);
  gl_.VertexAttribPointer(location, size, GL_FLOAT, GL_FALSE, static_cast<GLsizei>(stride),
                          offset_of(offset));
  gl_.VertexAttribDivisor(location, divisor);
}

/// For the vertex buffer that is bound.
void LayerRenderer::shape_attributes() {
  attribute(0, 3, sizeof(MeshVertex), offsetof(MeshVertex, core), 0);
  attribute(1, 3, sizeof(MeshVertex), offsetof(MeshVertex, direction), 0);
}

void LayerRenderer::instance_attributes() {
  gl_.BindBuffer(GL_ARRAY_BUFFER, instance_buffer_);
  constexpr std::size_t kFloat = sizeof(float);
  for (GLuint column = 0; column < 3; ++column)
    attribute(2 + column, 3, sizeof(Instance), offsetof(Instance, rotation) + column * 3 * kFloat, 1);
  attribute(5, 3, sizeof(Instance), offsetof(Instance, translation), 1);
  attribute(6, 4, sizeof(Instance), offsetof(Instance, scale), 1);
  attribute(7, 4, sizeof(Instance), offsetof(Instance, albedo), 1);
  attribute(8, 2, sizeof(Instance), offsetof(Instance, metallic), 1);
}

void LayerRenderer::make_instance_array() {
  shape_attributes();
  instance_attributes();
  gl_.GenVertexArrays(1, &empty_array_);
  gl_.GenVertexArrays(1, &shadow_array_);
  gl_.BindVertexArray(shadow_array_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, shadow_buffer_);
  attribute(0, 3, sizeof(ShadowVertex), offsetof(ShadowVertex, position), 0);
  attribute(1, 2, sizeof(ShadowVertex), offsetof(ShadowVertex, local), 0);
  attribute(2, 2, sizeof(ShadowVertex), offsetof(ShadowVertex, half), 0);
  attribute(3, 4, sizeof(ShadowVertex), offsetof(ShadowVertex, corner), 0);
}

void LayerRenderer::set_mesh(const BuildingMesh& mesh) {
  context_.make_current();
  if (mesh_array_ == 0) {
    gl_.GenVertexArrays(1, &mesh_array_);
    gl_.GenBuffers(1, &mesh_buffer_);
  }
  mesh_chunks_ = mesh.chunks;
  gl_.BindVertexArray(mesh_array_);
  gl_.BindBuffer(GL_ARRAY_BUFFER, mesh_buffer_);
  gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(MeshVertex)),
                 mesh.vertices.data(), GL_STATIC_DRAW);
  shape_attributes();
  instance_attributes();
}

const LayerRenderer::UploadedMesh& LayerRenderer::uploaded(const std::shared_ptr<const ShapeMesh>& mesh) {
  UploadedMesh& to = shape_meshes_[mesh.get()];
  if (to.array != 0) return to;
  const std::vector<MeshVertex> vertices = shape_mesh_vertices(*mesh);
  to.mesh = mesh;
  to.vertices = static_cast<GLsizei>(vertices.size());
  gl_.GenVertexArrays(1, &to.array);
  gl_.GenBuffers(1, &to.buffer);
  gl_.BindVertexArray(to.array);
  gl_.BindBuffer(GL_ARRAY_BUFFER, to.buffer);
  gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(MeshVertex)),
                 vertices.data(), GL_STATIC_DRAW);
  shape_attributes();
  instance_attributes();
  return to;
}

void LayerRenderer::release(Target& target) {
  gl_.DeleteFramebuffers(1, &target.framebuffer);
  const GLuint buffers[] = {target.colour, target.identity, target.depth};
  gl_.DeleteRenderbuffers(3, buffers);
  target = {};
}

/// Enlarges a frame buffer to hold a view; never shrinks it.
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

}  // namespace parhelion::render
