"""Three lines in a TraCI script of your own: two of its cars become emulated XGVs, and one is paused."""

import libsumo as traci  # or: import traci, with "sumo" or "sumo-gui" below

import xgv_cosim
from sumo_scenarios import list_scenarios

config = next(info.folder for info in list_scenarios() if info.name == "hello") / "hello.sumocfg"
safe = ["--collision.action=warn", "--collision.mingap-factor=0", "--collision.check-junctions"]
calm = ["--time-to-teleport=-1", "--lanechange.duration=3", "--no-step-log"]

plugin = xgv_cosim.attach(traci)
plugin.bind("xgv_*")
plugin.inject("xgv_0", kind="estop_pause", at_s=5.0, duration_s=6.0)

traci.start(["sumo", "-c", str(config), "--step-length=0.1", *safe, *calm])
while traci.simulation.getTime() < 20.0:  # your loop, unchanged
    traci.simulationStep()
    if round(traci.simulation.getTime(), 1) % 5 == 4:
        car = plugin.vehicle("xgv_0")
        print(f"{plugin.now_s:4.1f} s: {car.mode}, {traci.vehicle.getSpeed('xgv_0'):.1f} m/s")
traci.close()
