#pragma once

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

namespace smoke_ground_reconstruction {

/// Callbacks of a nodelet, one at a time, on a thread that the nodelet can end.
///
/// The loader's two queues will not do: it keeps a nodelet that it unloads alive for a callback at
/// work on the one and frees the other, on which the nodelet still hangs when that callback ends.
class CallbackThread {
 public:
  /// The same handle, but that its callbacks come here.
  ros::NodeHandle handle(ros::NodeHandle of) {
    of.setCallbackQueue(&queue_);
    return of;
  }

  /// Begins with what has come so far.
  void start() { spinner_.start(); }

  /// Waits for a callback that is at work and lets no other begin. Not from such a callback.
  void end() {
    queue_.disable();
    spinner_.stop();
  }

 private:
  ros::CallbackQueue queue_;
  ros::AsyncSpinner spinner_{1, &queue_};
};

}  // namespace smoke_ground_reconstruction
