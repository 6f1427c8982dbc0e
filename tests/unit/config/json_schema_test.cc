// The JSON Schema of rules: what editors complete and check.
#include "services/base/config/json_schema.h"

#include <gtest/gtest.h>

#include <boost/property_tree/json_parser.hpp>
#include <sstream>
#include <vector>

namespace fulcrum::config {
namespace {

using boost::property_tree::ptree;

ptree SchemaOf(const std::vector<KeyRule>& rules) {
  std::istringstream in(JsonSchema(rules, "a \"scene\""));
  ptree tree;
  boost::property_tree::read_json(in, tree);
  return tree;
}
std::string At(const ptree& tree, const char* path) { return tree.get<std::string>(ptree::path_type(path, '/'), "-"); }

TEST(JsonSchema, ValuesHaveTypeAndLimits) {
  const ptree schema = SchemaOf({{"rows", 0, "5", "an integer from 2 to 300"},
                                 {"gap_mm", 0, {}, "above 0 up to 20 mm"},
                                 {"share", 0, "", "at least 0.5"},
                                 {"is_open", 0, "false", "true, false"},
                                 {"name", 0, {}, "a text of 1 to 63 bytes"},
                                 {"mode", 0, "paper", "paper, accurate"},
                                 {"at_mm", 0, {}, "3 numbers, each -500 to 500 mm"},
                                 {"x_mm", 0, {}, "2 to 64 numbers, each any number"},
                                 {"folders", 0, "", "a list of 0 to 8 texts"}});
  EXPECT_EQ(At(schema, "title"), "a \"scene\"");
  EXPECT_EQ(At(schema, "additionalProperties"), "false");
  EXPECT_EQ(At(schema, "properties/rows/type"), "integer");
  EXPECT_EQ(At(schema, "properties/rows/minimum"), "2");
  EXPECT_EQ(At(schema, "properties/rows/maximum"), "300");
  EXPECT_EQ(At(schema, "properties/rows/description"), "default 5; valid: an integer from 2 to 300");
  EXPECT_EQ(At(schema, "properties/gap_mm/exclusiveMinimum"), "0");
  EXPECT_EQ(At(schema, "properties/gap_mm/maximum"), "20");
  EXPECT_EQ(At(schema, "properties/gap_mm/description"), "no default; valid: above 0 up to 20 mm");
  EXPECT_EQ(schema.get_child(ptree::path_type("properties/gap_mm/type", '/')).size(), 2u) << "number, or with a unit";
  EXPECT_EQ(At(schema, "properties/share/minimum"), "0.5");
  EXPECT_EQ(At(schema, "properties/is_open/type"), "boolean");
  EXPECT_EQ(At(schema, "properties/name/type"), "string");
  EXPECT_EQ(schema.get_child(ptree::path_type("properties/mode/enum", '/')).back().second.data(), "accurate");
  EXPECT_EQ(At(schema, "properties/at_mm/minItems"), "3");
  EXPECT_EQ(At(schema, "properties/at_mm/maxItems"), "3");
  EXPECT_EQ(At(schema, "properties/at_mm/items/minimum"), "-500");
  EXPECT_EQ(At(schema, "properties/x_mm/maxItems"), "64");
  EXPECT_EQ(At(schema, "properties/folders/items/type"), "string");
}

TEST(JsonSchema, MapsAndListsOfMapsAreNested) {
  const ptree schema = SchemaOf({{"organ", 0, {}, ""},
                                 {"organ.shape", 0, {}, ""},
                                 {"organ.shape.z_mm", 0, {}, "0 to 5 mm"},
                                 {"physics.dt_ms", 0, "10", "1 to 100 ms"},
                                 {"bodies", 0, "", "a list of 0 to 24 maps"},
                                 {"bodies[].name", 0, {}, "a text of 1 to 31 bytes"},
                                 {"bodies[].tube.z_mm", 0, {}, "0 to 5 mm"},
                                 {"bodies[].name", 0, {}, "a text of 1 to 32 bytes"}});
  EXPECT_EQ(At(schema, "properties/organ/properties/shape/properties/z_mm/maximum"), "5");
  EXPECT_EQ(At(schema, "properties/organ/properties/shape/additionalProperties"), "true");
  EXPECT_EQ(At(schema, "properties/physics/additionalProperties"), "false");
  EXPECT_EQ(At(schema, "properties/bodies/type"), "array");
  EXPECT_EQ(At(schema, "properties/bodies/items/properties/tube/properties/z_mm/maximum"), "5");
  EXPECT_EQ(At(schema, "properties/bodies/items/additionalProperties"), "true");
  EXPECT_EQ(At(schema, "properties/bodies/items/properties/name/description"),
            "no default; valid: a text of 1 to 31 bytes");
}

}  // namespace
}  // namespace fulcrum::config
