// Stands in for PCL 1.10, whose clouds live behind boost's shared pointers: put first in the include
// path, it makes a later PCL do the same, and code that names std::shared_ptr fails to compile. For
// syntax checks alone; it must not be linked.
#pragma once

#include <pcl/type_traits.h>

#include <Eigen/Core>
#include <boost/make_shared.hpp>
#include <boost/shared_ptr.hpp>
#include <boost/weak_ptr.hpp>
#include <memory>
#include <utility>

#define PCL_MAKE_ALIGNED_OPERATOR_NEW \
  EIGEN_MAKE_ALIGNED_OPERATOR_NEW     \
  using _custom_allocator_type_trait = void;

namespace pcl {

using boost::const_pointer_cast;
using boost::dynamic_pointer_cast;
using boost::shared_ptr;
using boost::static_pointer_cast;
using boost::weak_ptr;

template <typename T, typename... Arguments>
shared_ptr<T> make_shared(Arguments&&... arguments) {
  if constexpr (has_custom_allocator<T>::value) {
    return boost::allocate_shared<T>(Eigen::aligned_allocator<T>(),
                                     std::forward<Arguments>(arguments)...);
  } else {
    return boost::make_shared<T>(std::forward<Arguments>(arguments)...);
  }
}

}  // namespace pcl
