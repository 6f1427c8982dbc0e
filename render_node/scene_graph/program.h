// Shader programs from the sources in shaders/, which the build embeds: nothing is read at run time.
#pragma once

#include <osg/Program>
#include <string_view>

namespace fulcrum::render {

/// Source of the file of this name. Throws std::logic_error for a name that the build did not embed.
[[nodiscard]] std::string_view ShaderSource(std::string_view file);

/// Fragment shaders without a #version of their own get lighting.glsl in front.
[[nodiscard]] osg::ref_ptr<osg::Program> MakeProgram(std::string_view vertex_file, std::string_view fragment_file);

}  // namespace fulcrum::render
