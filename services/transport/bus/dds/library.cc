#include "services/transport/bus/dds/library.h"

#include <fastrtps/xmlparser/XMLProfileManager.h>

#include <cstdlib>

namespace fulcrum::bus::dds {

void PrepareLibrary() {
  for (const char* name :
       {"FASTDDS_STATISTICS", "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_ENVIRONMENT_FILE", "ROS_DISCOVERY_SERVER"}) {
    unsetenv(name);
  }
  setenv("SKIP_DEFAULT_XML", "1", 1);  // no DEFAULT_FASTRTPS_PROFILES.xml from the current directory
  eprosima::fastrtps::LibrarySettingsAttributes library;
  library.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
  eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(library);
}

}  // namespace fulcrum::bus::dds
