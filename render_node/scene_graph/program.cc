#include "render_node/scene_graph/program.h"

#include <string>

namespace fulcrum::render {

osg::ref_ptr<osg::Program> MakeProgram(std::string_view vertex_file, std::string_view fragment_file,
                                       std::string_view defined) {
  std::string fragment(ShaderSource(fragment_file));
  if (fragment.find("#version") == std::string::npos) {
    if (!defined.empty()) fragment.insert(0, "#define " + std::string(defined) + "\n");
    fragment.insert(0, ShaderSource("lighting.glsl"));
  }
  osg::ref_ptr<osg::Program> program = new osg::Program;
  program->setName(std::string(fragment_file));
  program->addShader(new osg::Shader(osg::Shader::VERTEX, std::string(ShaderSource(vertex_file))));
  program->addShader(new osg::Shader(osg::Shader::FRAGMENT, fragment));
  return program;
}

}  // namespace fulcrum::render
