#include "services/records/recorder/recorded_type.h"

#include "services/transport/bus/schema.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::recorder {
namespace {

/// For readers other than this project's; the meaning of the fields is in recording/point_coding.h.
constexpr const char* kRecordedTissueFrame = R"(
// A TissueFrame in a recording: the coordinates of its blocks as residuals.
module fulcrum {
module idl {

struct RecordedTissueFrame {
  TissueFrameHeader header;
  unsigned long kind;              // 0 key, 1 difference from the frame before, 2 relative to the neighbour's, 3 as sent
  unsigned long block_count;       // blocks of 64 vertices; those after the last vertex repeat it
  sequence<octet> residuals;       // of 5 um; zigzag; low bytes of all coordinates, then their second bytes, ...
};

};
};
)";

/// The encapsulation of CDR in front of a message [B].
constexpr std::size_t kEncapsulation_B = 4;
/// TissueFrameHeader in CDR: the stamp (32), seven numbers of 8 bytes, two of 4.
constexpr std::size_t kTissueHeader_B = 32 + 7 * 8 + 2 * 4;

}  // namespace

RecordedType RecordedTypeOf(TopicId topic) {
  const std::string type(bus::TopicLabel(topic));
  if (topic != TopicId::kTissueFrame) return {type, bus::SchemaText(type)};
  return {"RecordedTissueFrame", bus::SchemaText(type) + kRecordedTissueFrame};
}

recording::PointCoding TissueCoding() { return {.head_B = kEncapsulation_B + kTissueHeader_B}; }

}  // namespace fulcrum::recorder
