#pragma once

#include <GL/gl.h>
#include <GL/glext.h>

#include <string>

#include "errors.h"
#include "gl_context.h"

namespace anticrack {

/// The OpenGL functions the preview needs, looked up in the context: linking libGL would tie it to a display.
struct GlFunctions {
// clang-format moves the backslashes at every run.
// clang-format off
#define ANTICRACK_GL_FUNCTIONS(X)                                                                           \
  X(decltype(&glClear), Clear)                                                                              \
  X(decltype(&glClearColor), ClearColor)                                                                    \
  X(decltype(&glViewport), Viewport)                                                                        \
  X(decltype(&glEnable), Enable)                                                                            \
  X(decltype(&glDisable), Disable)                                                                          \
  X(decltype(&glDrawElements), DrawElements)                                                                \
  X(decltype(&glDrawArrays), DrawArrays) X(decltype(&glGenTextures), GenTextures)                           \
      X(decltype(&glBindTexture), BindTexture) X(decltype(&glTexParameteri), TexParameteri) X(              \
          decltype(&glTexImage2D), TexImage2D) X(decltype(&glPixelStorei), PixelStorei)                     \
          X(decltype(&glGetFloatv), GetFloatv) X(decltype(&glGetError), GetError) X(                        \
              PFNGLACTIVETEXTUREPROC, ActiveTexture) X(PFNGLCREATESHADERPROC, CreateShader)                 \
              X(PFNGLSHADERSOURCEPROC, ShaderSource) X(PFNGLCOMPILESHADERPROC, CompileShader) X(            \
                  PFNGLGETSHADERIVPROC, GetShaderiv) X(PFNGLGETSHADERINFOLOGPROC, GetShaderInfoLog)         \
                  X(PFNGLCREATEPROGRAMPROC, CreateProgram) X(PFNGLATTACHSHADERPROC, AttachShader) X(        \
                      PFNGLLINKPROGRAMPROC, LinkProgram) X(PFNGLUSEPROGRAMPROC, UseProgram)                 \
                      X(PFNGLGETPROGRAMIVPROC, GetProgramiv) X(                                             \
                          PFNGLGETUNIFORMLOCATIONPROC, GetUniformLocation) X(PFNGLUNIFORM1FPROC, Uniform1f) \
                          X(PFNGLUNIFORM1IPROC, Uniform1i) X(PFNGLUNIFORM3FPROC, Uniform3f) X(              \
                              PFNGLUNIFORM4FPROC, Uniform4f) X(PFNGLUNIFORMMATRIX4FVPROC, UniformMatrix4fv) \
                              X(PFNGLGENVERTEXARRAYSPROC, GenVertexArrays)                                  \
                                  X(PFNGLBINDVERTEXARRAYPROC, BindVertexArray)                              \
                                      X(PFNGLGENBUFFERSPROC, GenBuffers) X(PFNGLBINDBUFFERPROC, BindBuffer) \
                                          X(PFNGLBUFFERDATAPROC, BufferData)                                \
                                              X(PFNGLVERTEXATTRIBPOINTERPROC, VertexAttribPointer) X(       \
                                                  PFNGLENABLEVERTEXATTRIBARRAYPROC, EnableVertexAttribArray)
// clang-format on
#define ANTICRACK_GL_MEMBER(type, name) type name = nullptr;
  ANTICRACK_GL_FUNCTIONS(ANTICRACK_GL_MEMBER)
#undef ANTICRACK_GL_MEMBER

  explicit GlFunctions(const GlContext& context) {
    const auto find = [&]<class Function>(const char* name, Function& function) {
      function = reinterpret_cast<Function>(context.function(name));
      if (function == nullptr) throw InputError(std::string("OpenGL: the context lacks ") + name);
    };
#define ANTICRACK_GL_FIND(type, name) find("gl" #name, name);
    ANTICRACK_GL_FUNCTIONS(ANTICRACK_GL_FIND)
#undef ANTICRACK_GL_FIND
  }
#undef ANTICRACK_GL_FUNCTIONS
};

}  // namespace anticrack
