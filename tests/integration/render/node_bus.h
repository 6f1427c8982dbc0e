// In-process topics of a RenderNode with their other ends.
#pragma once

#include <memory>

#include "render_node/node/render_node.h"
#include "services/transport/bus/in_process.h"

namespace fulcrum::render {

struct NodeBus {
  bus::InProcessTopic<TissueFrame> tissue;
  bus::InProcessTopic<TopologyState> topology;
  bus::InProcessTopic<TemperaturePatch> patches;
  bus::InProcessTopic<ToolState> tools;
  bus::InProcessTopic<HandleState> handles;
  bus::InProcessTopic<ThermalEvent> events;
  bus::InProcessTopic<CauteryContact> contacts;
  bus::InProcessTopic<GeneratorSetting> generator;
  bus::InProcessTopic<ContactModel> contact_models;
  bus::InProcessTopic<ClipState> clips;
  bus::InProcessTopic<Picture> pictures;
  std::unique_ptr<bus::Input<TissueFrame>> tissue_in = tissue.MakeInput();
  std::unique_ptr<bus::Input<TopologyState>> topology_in = topology.MakeInput();
  std::unique_ptr<bus::Input<TemperaturePatch>> patches_in = patches.MakeInput();
  std::unique_ptr<bus::Input<ToolState>> tools_in = tools.MakeInput();
  std::unique_ptr<bus::Input<HandleState>> handles_in = handles.MakeInput();
  std::unique_ptr<bus::Input<ThermalEvent>> events_in = events.MakeInput();
  std::unique_ptr<bus::Input<CauteryContact>> contacts_in = contacts.MakeInput();
  std::unique_ptr<bus::Input<GeneratorSetting>> generator_in = generator.MakeInput();
  std::unique_ptr<bus::Input<ContactModel>> contact_models_in = contact_models.MakeInput();
  std::unique_ptr<bus::Input<ClipState>> clips_in = clips.MakeInput();
  std::unique_ptr<bus::LoanOutput<TissueFrame>> tissue_out = tissue.MakeOutput();
  std::unique_ptr<bus::Output<TopologyState>> topology_out = topology.MakeOutput();
  std::unique_ptr<bus::LoanOutput<TemperaturePatch>> patches_out = patches.MakeOutput();
  std::unique_ptr<bus::Output<ToolState>> tools_out = tools.MakeOutput();
  std::unique_ptr<bus::Output<HandleState>> handles_out = handles.MakeOutput();
  std::unique_ptr<bus::Output<ThermalEvent>> events_out = events.MakeOutput();
  std::unique_ptr<bus::Output<ContactModel>> contact_models_out = contact_models.MakeOutput();
  std::unique_ptr<bus::Output<ClipState>> clips_out = clips.MakeOutput();
  std::unique_ptr<bus::LoanOutput<Picture>> pictures_out = pictures.MakeOutput();

  /// Ports of the node.
  [[nodiscard]] RenderPorts ports() const {
    return {*tissue_in,   *topology_in,  *patches_in,        *tools_in, *handles_in, *events_in,
            *contacts_in, *generator_in, *contact_models_in, *clips_in, nullptr,     pictures_out.get()};
  }
};

}  // namespace fulcrum::render
