// Stands for libOSMesa.so.8 where the tests want it to fail: in what OSMESA_FAILS names. Draws nothing.
// With WITHOUT_FUNCTIONS it is a library that has none of them.
#ifndef WITHOUT_FUNCTIONS

#include <GL/osmesa.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

bool fails(const char* what) {
  const char* const failing = std::getenv("OSMESA_FAILS");
  return failing && std::strcmp(failing, what) == 0;
}

// For all functions whose result nobody reads.
void nothing() {}

GLenum error() {
  return fails("drawing") ? GL_OUT_OF_MEMORY : GL_NO_ERROR;
}
void shader_status(GLuint, GLenum, GLint* value) {
  *value = fails("shader") ? GL_FALSE : GL_TRUE;
}
void shader_log(GLuint, GLsizei size, GLsizei*, char* log) {
  std::snprintf(log, std::size_t(size), "0:7: syntax error");
}
void program_status(GLuint, GLenum, GLint* value) {
  *value = fails("program") ? GL_FALSE : GL_TRUE;
}

}  // namespace

extern "C" {

OSMesaContext OSMesaCreateContextAttribs(const int*, OSMesaContext) {
  return fails("context") ? nullptr : reinterpret_cast<OSMesaContext>(&nothing);
}
void OSMesaDestroyContext(OSMesaContext) {}
GLboolean OSMesaMakeCurrent(OSMesaContext, void*, GLenum, GLsizei, GLsizei) {
  return fails("size") ? GL_FALSE : GL_TRUE;
}
void OSMesaPixelStore(GLint, GLint) {}
void OSMesaGetIntegerv(GLint, GLint* value) {
  *value = 16384;
}
OSMESAproc OSMesaGetProcAddress(const char* name) {
  const auto is = [name](const char* other) { return std::strcmp(name, other) == 0; };
  if (is("glUseProgram") && fails("function")) return nullptr;
  if (is("glGetError")) return reinterpret_cast<OSMESAproc>(&error);
  if (is("glGetShaderiv")) return reinterpret_cast<OSMESAproc>(&shader_status);
  if (is("glGetShaderInfoLog")) return reinterpret_cast<OSMESAproc>(&shader_log);
  if (is("glGetProgramiv")) return reinterpret_cast<OSMESAproc>(&program_status);
  return &nothing;
}
}

#endif
