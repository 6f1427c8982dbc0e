// Receive buffers of the library's sockets. Internal to services/transport/bus/dds.
#pragma once

namespace fulcrum::bus::dds {

/// Enlarges the receive buffers of all UDP sockets of this process to kSocketBuffer_B where the system's limit
/// (net.core.rmem_max) granted less. Only a process with CAP_NET_ADMIN can; for others nothing changes.
void EnlargeReceiveBuffers();

}  // namespace fulcrum::bus::dds
