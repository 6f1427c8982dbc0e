// The recorder on the bus: every topic of the cart goes to a Recorder, a Command "dump" to its DumpWriter.
#pragma once

#include <memory>
#include <vector>

#include "services/base/core/tick.h"
#include "services/nodes/app/node_app.h"
#include "services/records/recorder/dump_writer.h"
#include "services/records/recorder/recorder.h"
#include "services/transport/bus/raw_input.h"

namespace fulcrum::recorder {

class RecorderNode {
 public:
  /// Joins the bus and receives from now on. `app` must outlive it. Before app->Run(). Throws InputError when the file
  /// cannot be made or the bus cannot be joined.
  RecorderNode(app::NodeApp* app, const RecorderSettings& settings);

  /// Writes what has come, and the dump that was asked for.
  void Step(const Tick& tick);
  /// Any thread.
  void FillHealth(Health* health) const;
  /// Leaves the topics, then ends the file. After the last Step.
  void Close();

 private:
  void ReceiveAllTopics(app::NodeApp* app);

  // The order of declaration is that of use: the inputs call the recorder, which asks the participant for the process
  // behind a writer.
  bus::DdsParticipant bus_;
  Recorder recorder_;
  DumpWriter dumps_;
  std::vector<std::unique_ptr<bus::RawInput>> inputs_;
};

}  // namespace fulcrum::recorder
