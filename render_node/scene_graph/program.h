// Shader programs from the sources in shaders/, which the build embeds, so that no file is read at run time.
#pragma once

#include <osg/Program>
#include <string_view>

namespace fulcrum::render {

/// Source text of a file in shaders/. Throws std::logic_error for a name that is not embedded.
[[nodiscard]] std::string_view ShaderSource(std::string_view file);

/// Makes a program. lighting.glsl is prepended to fragment shaders without a #version, and between the two the name
/// that the fragment shader's #ifdef asks for, if one is given.
[[nodiscard]] osg::ref_ptr<osg::Program> MakeProgram(std::string_view vertex_file, std::string_view fragment_file,
                                                     std::string_view defined = {});

}  // namespace fulcrum::render
