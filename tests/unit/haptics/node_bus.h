// In-process topics of a HapticsNode with their other ends.
#pragma once

#include <memory>

#include "haptics_node/node/haptics_node.h"
#include "services/transport/bus/in_process.h"

namespace fulcrum::haptics::testing {

struct NodeBus {
  bus::InProcessTopic<ContactModel> models;
  bus::InProcessTopic<OperatorInput> operators;
  bus::InProcessTopic<ToolState> tools;
  bus::InProcessTopic<TickManifest> manifests;
  std::unique_ptr<bus::Output<ContactModel>> model_out = models.MakeOutput();
  std::unique_ptr<bus::Input<ContactModel>> model_in = models.MakeInput();
  std::unique_ptr<bus::Output<OperatorInput>> operator_out = operators.MakeOutput();
  std::unique_ptr<bus::Input<OperatorInput>> operator_in = operators.MakeInput(64);
  std::unique_ptr<bus::Output<ToolState>> tool_out = tools.MakeOutput();
  std::unique_ptr<bus::Input<ToolState>> tool_in = tools.MakeInput(4);
  std::unique_ptr<bus::Output<TickManifest>> manifest_out = manifests.MakeOutput();
  std::unique_ptr<bus::Input<TickManifest>> manifest_in = manifests.MakeInput(64);

  std::shared_ptr<runtime::Bell> bell = std::make_shared<runtime::Bell>();

  /// The node's.
  [[nodiscard]] HapticsNode::Ports ports() const { return {*model_in, *operator_in, *tool_out, *manifest_out, bell}; }
};

}  // namespace fulcrum::haptics::testing
