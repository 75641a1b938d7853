// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/master_watch.h"

#include <fmt/format.h>
#include <ros/connection_manager.h>
#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/publication.h>
#include <ros/this_node.h>
#include <ros/topic_manager.h>
#include <ros/xmlrpc_manager.h>
#include <xmlrpcpp/XmlRpc.h>

#include <chrono>

namespace backlash::ros_bridge {
namespace {

using XmlRpc::XmlRpcValue;

XmlRpcValue arguments(const std::vector<std::string>& values) {
  XmlRpcValue list;
  list.setSize(static_cast<int>(values.size()) + 1);
  list[0] = ros::this_node::getName();
  for (std::size_t i = 0; i < values.size(); ++i) list[static_cast<int>(i) + 1] = values[i];
  return list;
}

bool ask(const std::string& method, const std::vector<std::string>& values, XmlRpcValue& answer) {
  XmlRpcValue result;
  return ros::master::execute(method, arguments(values), result, answer, false);
}

/// Of a list of [name, [nodes]], the names with this node.
std::vector<std::string> names_of_this_node(XmlRpcValue& list) {
  std::vector<std::string> names;
  for (int i = 0; i < list.size(); ++i)  // NOLINT(modernize-loop-convert): begin() is of a struct
    for (int node = 0; node < list[i][1].size(); ++node)
      if (static_cast<std::string>(list[i][1][node]) == ros::this_node::getName())
        names.push_back(list[i][0]);
  return names;
}

const std::string& own_uri() {
  return ros::XMLRPCManager::instance()->getServerURI();
}

/// The master informs the subscribers.
bool publish_again(const std::string& topic) {
  XmlRpcValue subscribers;
  const ros::PublicationPtr publication = ros::TopicManager::instance()->lookupPublication(topic);
  return publication && ask("registerPublisher", {topic, publication->getDataType(), own_uri()}, subscribers);
}

/// Publishers that the master knows already are reported to this node as the master itself would later.
bool subscribe_again(const std::string& topic) {
  XmlRpcValue publishers;
  if (!ask("registerSubscriber", {topic, "*", own_uri()}, publishers)) return false;
  if (publishers.size() == 0) return true;
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(own_uri(), host, port)) return false;
  XmlRpcValue update, result;
  update[0] = "/master";
  update[1] = topic;
  update[2] = publishers;
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  return client.execute("publisherUpdate", update, result);
}

bool serve_again(const std::string& service) {
  XmlRpcValue nothing;
  const std::string uri = fmt::format("rosrpc://{}:{}", ros::network::getHost(),
                                      ros::ConnectionManager::instance()->getTCPPort());
  return ask("registerService", {service, uri, own_uri()}, nothing);
}

bool register_again(const Registrations& known) {
  bool done = true;
  for (const std::string& topic : known.publications) done = publish_again(topic) && done;
  for (const std::string& topic : known.subscriptions) done = subscribe_again(topic) && done;
  for (const std::string& service : known.services) done = serve_again(service) && done;
  return done;
}

}  // namespace

MasterWatch::MasterWatch(double interval) : thread_(&MasterWatch::run, this, interval) {}

MasterWatch::~MasterWatch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void MasterWatch::run(double interval) {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!changed_.wait_for(lock, std::chrono::duration<double>(interval), [this] { return stop_; })) {
    lock.unlock();
    try {
      look();
    } catch (const XmlRpc::XmlRpcException& error) {
      ROS_WARN("the ROS master gives a strange answer: %s", error.getMessage().c_str());
    }
    lock.lock();
  }
}

void MasterWatch::look() {
  XmlRpcValue state;
  const bool here = ask("getSystemState", {}, state);
  if (here == away_) {
    away_ = !here;
    if (away_)
      ROS_WARN("the ROS master at %s does not answer: nobody new finds this node until it does",
               ros::master::getURI().c_str());
    else
      ROS_INFO("the ROS master answers again");
  }
  if (!here) return;
  const Registrations now = {names_of_this_node(state[0]), names_of_this_node(state[1]),
                             names_of_this_node(state[2])};
  if (!now.empty() && complete_) {
    known_ = now;
    return;
  }
  if (known_.empty() || !ros::ok()) return;
  complete_ = register_again(known_);
  if (complete_)
    ROS_WARN("the ROS master did not know this node any more (it was started again): registered again");
  else
    ROS_ERROR("the ROS master does not know this node any more and refuses a part of the registrations");
}

}  // namespace backlash::ros_bridge
