// The recorder on the bus: passes every topic of the cart to a Recorder, and a Command "dump" to its DumpWriter.
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
  /// Joins the bus and begins to receive. `app` must outlive the object. To be constructed before app->Run(). Throws
  /// InputError if the file cannot be created or the bus cannot be joined.
  RecorderNode(app::NodeApp* app, const RecorderSettings& settings);

  /// Writes the received samples, and a dump if one was requested.
  void Step(const Tick& tick);
  /// May be called on any thread.
  void FillHealth(Health* health) const;
  /// Removes the inputs, then ends the file. To be called after the last Step.
  void Close();

 private:
  void ReceiveAllTopics(app::NodeApp* app);

  app::NodeApp* app_;
  bool has_ended_ = false;  ///< Health has told of the end of the recording.
  // Declared in the order of dependence: the inputs call the recorder, which reads the process behind a writer from the
  // participant.
  bus::DdsParticipant bus_;
  Recorder recorder_;
  DumpWriter dumps_;
  std::vector<std::unique_ptr<bus::RawInput>> inputs_;
};

}  // namespace fulcrum::recorder
