"""Step a simulation by hand, press the SafeStop, and make a whole run with its folder."""

import xgv_cosim

with xgv_cosim.simulate("freeway_estop", seed=3) as sim:
    sim.run_until(5.0)  # or sim.step(), 0.1 s each
    car = sim.vehicle("xgv_0")
    car.estop("pause")  # the toggle of the SafeStop transmitter
    while car.speed_mps > 0.1:
        sim.step()
    print(f"{sim.now_s:.1f} s: {car.mode} because of {car.reasons}, at {car.pose}")
    car.estop("run")
    sim.run_until(sim.now_s + 5.0)
    print(f"{sim.now_s:.1f} s: {car.mode}, {car.speed_mps:.1f} m/s")

result = xgv_cosim.run("hello", seed=3, out="runs/mine")  # a whole run, with its folder and report
print(result.status, result.trace_hash, result.folder / "report.html")
