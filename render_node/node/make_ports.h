// The ports of a RenderNode in a process of its own.
#pragma once

#include "render_node/node/render_node.h"

namespace fulcrum::render {

/// @param app app::NodeApp, which keeps the ports. @param operators what every source does; null without `hands`.
/// @param hands whether the window operates the tools.
template <class App>
RenderPorts MakePorts(App& app, bool hands, bus::Input<OperatorInput>* operators) {
  return {app.template MakeInput<TissueFrame>(),
          app.template MakeInput<TopologyState>(),
          app.template MakeInput<TemperaturePatch>(),
          app.template MakeInput<ToolState>(),
          app.template MakeInput<HandleState>(),
          app.template MakeInput<ThermalEvent>(),
          app.template MakeInput<CauteryContact>(),
          app.template MakeInput<GeneratorSetting>(),
          app.template MakeInput<ContactModel>(),
          app.template MakeInput<ClipState>(),
          hands ? &app.template MakeOutput<OperatorInput>() : nullptr,
          &app.template MakeOutput<Picture>(),
          operators};
}

}  // namespace fulcrum::render
